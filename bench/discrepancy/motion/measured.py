"""The motion of the degrees of freedom from the channels that observe them, one by one or in combination."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial

from bench.arrays import Array
from bench.discrepancy.motion.kalman_smoother import smooth_motion
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.settings import MotionSettings
from bench.discrepancy.simulation.stick_slip import Motion


def measured_motion(
    observers: Sequence[Observer],
    samples: Array,
    noise: Array,
    step: float,
    *,
    at_rest: bool = True,
    settings: MotionSettings,
) -> Motion:
    """Smoothed motion of every degree of freedom that the channels determine; zero for the others.

    Channels of one order are solved for the degrees of freedom, so that relative, scaled and reversed sensors serve
    as well as plain ones; the orders are then fused by `smooth_motion`.

    Args:
        observers: The channels.
        samples: (n, n_channels).
        noise: (n_channels,) one-sigma noise.
        step: Time between samples [s].
        at_rest: Whether the record starts at rest. An integral starts at zero; where the motion does not, what grows
            evenly with time is the start that was missed and is taken off.
        settings: `MotionSettings` of the diagnosis.
    """
    n_dof = len(observers[0].row)
    known: list[list[tuple[int, Array, float]]] = [[] for _ in range(n_dof)]
    for order in range(3):
        index = [c for c, o in enumerate(observers) if o.order == order]
        if not index:
            continue
        rows = np.array([observers[c].row for c in index])
        inverse = np.linalg.pinv(rows)
        resolved = inverse @ rows
        for i in range(n_dof):
            if np.max(np.abs(resolved[i] - np.eye(n_dof)[i])) < 1e-9:
                level = float(np.sqrt(np.sum((inverse[i] * noise[index]) ** 2)))
                known[i].append((order, samples[:, index] @ inverse[i], level))
    out = np.zeros((3, len(samples), n_dof))
    for i, entries in enumerate(known):
        if entries:
            orders, columns, levels = zip(*entries, strict=True)
            out[:, :, i] = smooth_motion(
                np.column_stack(columns), orders, np.array(levels), step, settings=settings
            ).T
            if not at_rest and min(orders) > 0:
                missed = Polynomial.fit(
                    np.arange(len(samples)) * step, out[0, :, i], min(orders) - 1
                ).convert()
                out[0, :, i] -= missed(np.arange(len(samples)) * step)
                out[1, :, i] -= missed.deriv()(np.arange(len(samples)) * step)
    return Motion(*out)
