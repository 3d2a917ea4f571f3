"""What the lag of Nastran's nonlinear loads by one step does to a response."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, SimulationError
from bench.nastran.expanded import ExpandedSystem
from bench.nastran.integration import Hold, Method, Start, integrate


class LagStudy(NamedTuple):
    """Error of Nastran's evaluation over the time step."""

    steps: NDArray[np.float64]
    """[s]"""
    errors: NDArray[np.float64]
    """RMS error of the relative states over their RMS, ``(n_steps, n1)``; infinite where the integration diverged."""
    orders: NDArray[np.float64]
    """Slope of log error over log step between neighbouring steps, ``(n_steps - 1, n1)``."""


def lag_study(
    system: ExpandedSystem,
    drive: Callable[[NDArray[np.float64]], ArrayLike],
    *,
    duration: float,
    steps: Sequence[float],
    start: Start = "zero",
    averaged: bool = True,
    initial: Mapping[str, tuple[float, float]] | None = None,
) -> LagStudy:
    """Error of Nastran's evaluation against the consistent integration, for several time steps.

    The reference is the consistent integration with a fourth of the smallest step and commands drawn as straight lines, so
    that the error measured is the scheme's and not the sampling of the excitation.

    Args:
        system: The system, in the form "deck".
        drive: Commands ``(n, n_actuators)`` at given times ``(n,)`` [s].
        duration: Length [s].
        steps: Time steps [s], whole multiples of the smallest.
        start: As for `integrate`.
        averaged: As for `integrate`.
        initial: As for `integrate`.

    Raises:
        ParameterError: The steps are no multiples of the smallest.
    """
    chosen = np.sort(np.asarray(steps, dtype=float))
    fine = chosen[0] / 4.0
    strides = chosen / fine
    if len(chosen) < 2 or not np.allclose(strides, np.round(strides), atol=1e-6):
        raise ParameterError(
            f"steps {chosen} came; at least two, whole multiples of the smallest, are expected"
        )

    def run(h: float, method: Method, hold: Hold) -> NDArray[np.float64]:
        time = np.linspace(0.0, round(duration / h) * h, round(duration / h) + 1)
        commands = np.asarray(drive(time), dtype=float)
        response = integrate(
            system,
            commands,
            timestep=h,
            method=method,
            hold=hold,
            start=start,
            averaged=averaged,
            initial=initial,
        )
        return response.relative

    reference = run(fine, "consistent", "linear")
    errors = []
    for h, stride in zip(chosen, np.round(strides).astype(int), strict=True):
        true = reference[::stride]
        try:
            ours = run(float(h), "nastran", "zero")
        except SimulationError:
            errors.append(np.full(true.shape[1], np.inf))
            continue
        n = min(len(true), len(ours))
        errors.append(np.sqrt(np.mean((ours[:n] - true[:n]) ** 2, axis=0) / np.mean(true[:n] ** 2, axis=0)))
    table = np.array(errors)
    with np.errstate(invalid="ignore"):
        orders = np.diff(np.log(table), axis=0) / np.diff(np.log(chosen))[:, None]
    return LagStudy(chosen, table, orders)
