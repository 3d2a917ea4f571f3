"""Design model of a nonlinear viscous damper, ``F = C sgn(v)|v|^n``: fitted off line and on line, and whether to believe it.

Off line, C and n minimise the squared force error; on line, the adaptive estimator takes the logarithmic form
``log|F| = log C + n log|v|``, which weighs small velocities as much as large ones, so that the two differ wherever the
damper is not exactly of that form (friction lowers n and C in the logarithmic fit more than in the other).

The model is a curve in the force-velocity plane. A damper that yields elastically, or carries inertia or friction of
its supports, draws a loop there, narrow in slow harmonic motion and wide under random motion. The fit then still returns
a C and an n, and they mean nothing: `check_design_model` looks for the loop and refuses.

References:
    Tasbihgoo 2006, eqs 3.2-3.8 and figs 3.3, 3.10; Soong, T. T. and Dargush, G. F. 1997, Passive Energy Dissipation Systems.
    Worden, K. and Tomlinson, G. R. 2001, Nonlinearity in Structural Dynamics (NMSE below 5 % is a good fit).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.recording import nmse


@dataclass(frozen=True)
class DesignModelSettings:
    """Numbers of `bench.identification.damper`."""

    good_fit: float = 5.0
    """NMSE [%] below which a fit counts as good (Worden and Tomlinson 2001)."""
    memory_limit: float = 2.0
    """Share of the force variance [%] that displacement and acceleration may explain beyond velocity."""
    loop_limit: float = 0.15
    """Half width of the force-velocity loop over the rms force that is still a curve."""
    opposed_limit: float = 0.05
    """Share of moving samples in which the damper may push along its velocity."""


SETTINGS = DesignModelSettings()


class DesignFit(NamedTuple):
    """Design model fitted by nonlinear least squares.

    Attributes:
        coefficient: C [N (s/m)^n].
        exponent: n [1].
        coefficient_std: Standard deviation of C, residuals taken as white.
        exponent_std: Standard deviation of n.
        nmse: Misfit [%].
    """

    coefficient: float
    exponent: float
    coefficient_std: float
    exponent_std: float
    nmse: float


class OnlineDesignFit(NamedTuple):
    """Design model identified on line.

    Attributes:
        coefficient: C, mean over the last two periods [N (s/m)^n].
        exponent: n, likewise.
        nmse: Misfit of this pair over the record [%].
        time: Times of the history (m,) [s].
        coefficients: C after each sample (m,).
        exponents: n after each sample (m,).
        settled: Periods until the force of C and n stays within 10 % of the final pair's, at the peak speed and at half of it;
            inf if never.
    """

    coefficient: float
    exponent: float
    nmse: float
    time: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    exponents: NDArray[np.float64]
    settled: float


def design_force(velocity: ArrayLike, coefficient: float, exponent: float) -> NDArray[np.float64]:
    """``C sgn(v)|v|^n``.

    Args:
        velocity: v, any shape [m/s].
        coefficient: C [N (s/m)^n].
        exponent: n [1].
    """
    v = np.asarray(velocity, dtype=float)
    return coefficient * np.sign(v) * np.abs(v) ** exponent


def fit_design_model(velocity: ArrayLike, force: ArrayLike) -> DesignFit:
    """Fit C and n by nonlinear least squares on the force.

    Args:
        velocity: v (n,) [m/s].
        force: F (n,) [N].

    Returns:
        The fit; whether the model suits the damper at all is `check_design_model`'s to say.

    Raises:
        RecordingError: Lengths differ, values are not finite, or the damper does not move.
        IdentificationError: Force and velocity are opposed throughout (a sign error in one of the channels).
    """
    v, f = paired(velocity, force)
    v_scale, f_scale = float(np.abs(v).max()), float(np.abs(f).max())
    u, y = v / v_scale, f / f_scale
    moving = (np.abs(u) > 0.05) & (u * y > 0.0)
    if np.sum(moving) < 3:
        raise IdentificationError(
            "force and velocity are opposed in nearly all samples; a damper's force is taken positive along its velocity: "
            "turn the sign of one channel"
        )
    # log |u|, with the limit 0 of |u|^n log |u| at rest
    log_u = np.log(np.maximum(np.abs(u), 1e-300))
    slope, intercept = np.polyfit(log_u[moving], np.log(np.abs(y[moving])), 1)

    def shape(p: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sign(u) * np.abs(u) ** p[1]

    def jacobian(p: NDArray[np.float64]) -> NDArray[np.float64]:
        basis = shape(p)
        return np.column_stack([basis, p[0] * basis * log_u])

    start = np.array([math.exp(intercept), min(max(slope, 0.05), 2.9)])
    result = optimize.least_squares(
        lambda p: p[0] * shape(p) - y,
        start,
        jac=jacobian,
        bounds=([0.0, 0.01], [np.inf, 3.0]),
        x_scale="jac",
    )
    scale, exponent = map(float, result.x)
    variance = 2.0 * result.cost / max(u.size - 2, 1)
    covariance = variance * np.linalg.pinv(result.jac.T @ result.jac)
    # C = scale * f_scale / v_scale^n, so that log C moves with n as well.
    coefficient = scale * f_scale / v_scale**exponent
    gradient = coefficient * np.array([1.0 / scale, -math.log(v_scale)]) if scale > 0.0 else np.zeros(2)
    return DesignFit(
        coefficient=coefficient,
        exponent=exponent,
        coefficient_std=float(np.sqrt(max(gradient @ covariance @ gradient, 0.0))),
        exponent_std=float(np.sqrt(max(covariance[1, 1], 0.0))),
        nmse=nmse(f, design_force(v, coefficient, exponent)),
    )


def fit_design_model_online(
    time: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    *,
    frequency: float,
    memory: float = 3.0,
    velocity_floor: float = 0.05,
    force_floor: float = 0.02,
) -> OnlineDesignFit:
    """Identify C and n of a harmonic test on line, in the logarithmic form (eq. 3.8).

    Args:
        time: (n,) [s].
        velocity: v (n,) [m/s].
        force: F (n,) [N].
        frequency: Of the test [Hz].
        memory: Periods the estimator remembers (1 / forgetting).
        velocity_floor: Samples slower than this fraction of the peak are passed over.
        force_floor: Likewise for the force.

    Returns:
        Estimates and their course.

    Raises:
        RecordingError: Lengths differ, values are not finite, or the damper does not move.
        IdentificationError: Fewer than three periods, or nothing to learn from.
        ParameterError: A frequency or memory that is not positive.
    """
    from bench.identification.adaptive import AdaptiveLeastSquares  # noqa: PLC0415  (compiled code, not for every user)
    from bench.identification.regressors import damper_model  # noqa: PLC0415

    if not (frequency > 0.0 and memory > 0.0):
        raise ParameterError(
            f"frequency {frequency} Hz and memory {memory} came; positive numbers are expected"
        )
    t, v, f = _harmonic_test(time, velocity, force, frequency)
    v_peak = float(np.abs(v).max())
    # Speeds relative to the peak: log|v| is then of the order of one and log C' the log of the peak force.
    model = damper_model(velocity_floor=velocity_floor, force_floor=force_floor)
    estimator = AdaptiveLeastSquares(
        model, forgetting=frequency / memory, initial_covariance=1e4 * frequency, window=2.0 / frequency
    )
    f_peak = float(np.abs(f).max())
    history = estimator.run(t, force=f / f_peak, velocity=v / v_peak)
    if estimator.used < 10:
        raise IdentificationError(
            "fewer than ten samples lie above the floors with force along velocity; nothing was learnt"
        )
    exponents = history.theta[:, 1]
    log_peak = history.theta[:, 0]
    # An exponent met in the first few samples may be absurd, and its power overflow; it is history, not an estimate.
    coefficients = np.exp(np.clip(log_peak + math.log(f_peak) - exponents * math.log(v_peak), -700.0, 700.0))
    last = t >= t[-1] - 2.0 / frequency
    coefficient, exponent = float(np.mean(coefficients[last])), float(np.mean(exponents[last]))
    return OnlineDesignFit(
        coefficient=coefficient,
        exponent=exponent,
        nmse=nmse(f, design_force(v, coefficient, exponent)),
        time=t.copy(),
        coefficients=coefficients,
        exponents=exponents.copy(),
        settled=_settled(t, log_peak, exponents, last) * frequency,
    )


def _harmonic_test(
    time: ArrayLike, velocity: ArrayLike, force: ArrayLike, frequency: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Time, velocity and force of a test, as equal rows of at least three periods."""
    v, f = paired(velocity, force)
    t = np.asarray(time, dtype=float)
    if t.shape != v.shape or (t[-1] - t[0]) * frequency < 2.99:
        raise IdentificationError(
            f"{(t[-1] - t[0]) * frequency:.1f} periods came; at least three are needed, two of them for the means"
        )
    return t, v, f


def _settled(
    t: NDArray[np.float64],
    log_peak: NDArray[np.float64],
    exponents: NDArray[np.float64],
    last: NDArray[np.bool_],
) -> float:
    """Time until the force stays within 10 % of that of the final pair, at the peak speed and at half of it; inf if never [s].

    Args:
        t: Times (n,) [s].
        log_peak: Logarithm of the force at the peak speed after each sample (n,).
        exponents: Exponent after each sample (n,).
        last: The samples whose means are the final pair (n,).
    """
    at_peak = log_peak - float(np.mean(log_peak[last]))
    at_half = at_peak + (exponents - float(np.mean(exponents[last]))) * math.log(0.5)
    outside = np.flatnonzero(np.maximum(np.abs(at_peak), np.abs(at_half)) > math.log(1.1))
    if outside.size == 0:
        return 0.0
    return math.inf if outside[-1] == t.size - 1 else float(t[outside[-1]] - t[0])


def paired(velocity: ArrayLike, force: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity and force of a damper as rows (n,) that fit together.

    Raises:
        RecordingError: Lengths differ, values are not finite, or one does not change.
    """
    v, f = np.asarray(velocity, dtype=float), np.asarray(force, dtype=float)
    if v.ndim != 1 or v.shape != f.shape or v.size < 10:
        raise RecordingError(
            f"velocity {v.shape} and force {f.shape} came; equal rows (n,) of at least ten are expected"
        )
    for name, array in (("velocity", v), ("force", f)):
        if not np.all(np.isfinite(array)):
            raise RecordingError(
                f"{name} is not finite at sample {int(np.argmin(np.isfinite(array)))}; cut or repair it"
            )
        if np.ptp(array) == 0.0:
            raise RecordingError(f"{name} does not change; a damper is identified from its motion")
    return v, f
