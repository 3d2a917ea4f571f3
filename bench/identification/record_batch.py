"""Records of one rig from many starts, by the compiled loop, over threads."""

from __future__ import annotations

import numba
import numpy as np

from bench.identification.record_loop import run


@numba.njit(cache=True, error_model="numpy", nogil=True)
def run_records(first, last, constants, controls, solved, elements, observe, states, sizes, scratch, out):
    """Fill the records ``first … last − 1`` of `out` ``(n_records, n_samples, n_channels)``; see `record_loop.run`.

    Args:
        first: First record.
        last: One past the last record.
        constants: Degrees of freedom, states, step, start time, tolerance, stride.
        controls: Commands of all records ``(n_steps, n_inputs)``, the last one the constant 1.
        solved: System, inputs and spread.
        elements: Table, coordinates, their inputs, parameters.
        observe: Channels.
        states: States at the start ``(n_records, padded(n))``; those at the end on return.
        sizes: Least peaks ``(n,)``.
        scratch: Numbers of scratch, `record_loop.work_size`.
        out: The records.
    """
    n_dof, n, step, start_time, tolerance, stride = constants
    system, inputs, spread = solved
    table, rows, row_inputs, theta = elements
    work = np.zeros(scratch)
    for i in range(first, last):
        run(
            n_dof, n, step, start_time, tolerance, stride, controls, system, inputs, table, rows, row_inputs,
            spread, theta, observe, states[i], sizes, work, out[i],
        )  # fmt: skip
