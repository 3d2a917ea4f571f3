"""How large things are, and how close a corrected model has to come."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from third_laboratory_cases.case import Signals
from third_laboratory_cases.sizing import rms

from bench.arrays import Array
from fourth_laboratory_cases.case import Case, Excited

BOUND = 2.0
"""Stated standard deviations within which the parameters of the nominal model are fitted."""
LARGEST_LIMIT = 0.5
"""No derived limit is larger."""


class Size(NamedTuple):
    """Sizes of what a case holds, as NRMSE of one response on the validation record.

    Attributes:
        effect: What the missing effect makes of it.
        background: What the small physics besides makes of it.
        noise: Its measurement noise.
        left: What the nominal model leaves at best within two stated standard deviations, without noise.
    """

    effect: float
    background: float
    noise: float
    left: float


Sizes = Mapping[str, Size]
"""Sizes by the name of the response."""


def nrmse(one: Array, other: Array) -> float:
    """Root mean square of the difference of two signals (n,), over the standard deviation of the second."""
    return rms(one - other) / float(np.std(other))


def sizes_of(case: Case, excited: Excited) -> Sizes:
    """Sizes of a case on its validation record."""
    clock, (complete, effect_alone, neither) = case.clock, case.specimen.compared(excited)
    full, alone, without = (clock.sampled(signals) for signals in (complete, effect_alone, neither))
    noise = {
        channel.signal: channel.noise_std(full[channel.signal]) / float(np.std(full[channel.signal]))
        for channel in case.channels.values()
        if channel.signal in case.judged
    }
    left = left_by_nominal(case, excited, complete)
    return {
        name: Size(nrmse(without[name], alone[name]), nrmse(alone[name], full[name]), noise[name], left[name])
        for name in case.judged
    }


def left_by_nominal(case: Case, excited: Excited, measured: Signals) -> dict[str, float]:
    """NRMSE of each response that the nominal model leaves, fitted to the record that is measured at each step without noise."""
    truth = case.specimen.stated_values()
    full = case.clock.sampled(measured)
    parameters = list(case.parameters.values())

    def modelled(off: Array) -> Signals:
        """Signals of a nominal model that is off by multiples of its stated uncertainty."""
        values = {
            p.of: truth[p.of] + each * p.relative * abs(truth[p.of])
            for p, each in zip(parameters, off.tolist(), strict=True)
        }
        return case.clock.sampled(case.specimen.nominal(excited, {**truth, **values}, measured))

    def errors(off: Array) -> Array:
        got = modelled(off)
        parts = [(got[s] - full[s]) / np.std(full[s]) / math.sqrt(len(full[s])) for s in case.judged]
        return np.concatenate(parts)

    # not from zero: parameters there already would leave a difference quotient no scale
    start = np.full(len(parameters), 0.01)
    best = least_squares(errors, start, bounds=(-BOUND, BOUND), diff_step=1e-3, max_nfev=25).x
    got = modelled(best)
    return {name: nrmse(got[name], full[name]) for name in case.judged}


def limit(case: Case, sizes: Sizes) -> float | None:
    """Largest NRMSE of a corrected model that is accepted; None where no catalogue holds what is missing."""
    if case.limit != "derived":
        return case.limit
    if not case.right:
        return None
    left = max(math.hypot(size.left, size.noise) for size in sizes.values())
    floor = 2.5 * max(math.hypot(size.background, size.noise) for size in sizes.values())
    return round(min(0.6 * left, LARGEST_LIMIT, max(0.35 * left, floor)), 3)
