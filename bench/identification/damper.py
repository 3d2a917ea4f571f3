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
from scipy import optimize, stats

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.recording import nmse


@dataclass(frozen=True)
class DamperSettings:
    """Numbers of `bench.identification.damper`."""

    good_fit: float = 5.0
    """NMSE [%] below which a fit counts as good (Worden and Tomlinson 2001)."""
    memory_limit: float = 2.0
    """Share of the force variance [%] that displacement and acceleration may explain beyond velocity."""
    loop_limit: float = 0.15
    """Half width of the force-velocity loop over the rms force that is still a curve."""
    opposed_limit: float = 0.05
    """Share of moving samples in which the damper may push along its velocity."""


SETTINGS = DamperSettings()


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


class TrustReport(NamedTuple):
    """Whether the design model may be used for a damper in the motion recorded.

    Attributes:
        trusted: The verdict.
        reasons: What speaks against it, one sentence each.
        fit: The fitted model.
        opposed: Share of the moving samples in which force and velocity point in opposite directions.
        loop_width: Half width of the loop, force at equal velocity while accelerating less while decelerating, over rms F.
        memory_share: Share of the force variance that displacement and acceleration explain beyond velocity [%].
        f_statistic: F of the lack-of-fit test for these terms, correlated residuals counted once.
        p_value: Its probability if the design model were true.
        velocity_bins: Centres of the velocity bins (b,) [m/s].
        accelerating: Mean force in each bin while the velocity rises (b,) [N]; NaN where there are no samples.
        decelerating: Mean force while it falls (b,) [N].
    """

    trusted: bool
    reasons: tuple[str, ...]
    fit: DesignFit
    opposed: float
    loop_width: float
    memory_share: float
    f_statistic: float
    p_value: float
    velocity_bins: NDArray[np.float64]
    accelerating: NDArray[np.float64]
    decelerating: NDArray[np.float64]


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
    v, f = _pair(velocity, force)
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
        jac=jacobian,  # pyright: ignore[reportArgumentType]  (scipy's stub knows its strings only)
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
    v, f = _pair(velocity, force)
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


def check_design_model(
    time: ArrayLike, displacement: ArrayLike, velocity: ArrayLike, force: ArrayLike, *, n_bins: int = 20
) -> TrustReport:
    """Judge whether the design model describes a damper in the motion recorded, and say why not.

    Four questions are put to the best fit: is its misfit small (NMSE), does the damper ever push along its motion, is the
    force at equal velocity the same while accelerating and decelerating (a loop or a curve), and do displacement and
    acceleration explain what velocity does not (F-test for lack of fit, with the number of samples reduced to the
    number of independent ones by the correlation of the residual). On long records the F-test finds differences of no
    importance, therefore its share of the variance counts and not its significance alone.

    Args:
        time: (n,) [s].
        displacement: x (n,) [m].
        velocity: v (n,) [m/s].
        force: F (n,) [N].
        n_bins: Number of velocity bins of the loop.

    Returns:
        The report.

    Raises:
        RecordingError: Lengths differ, values are not finite, or the damper does not move.
        IdentificationError: As `fit_design_model`.
    """
    v, f = _pair(velocity, force)
    t, x = np.asarray(time, dtype=float), np.asarray(displacement, dtype=float)
    if t.shape != v.shape or x.shape != v.shape:
        raise RecordingError(
            f"time {t.shape}, displacement {x.shape} and velocity {v.shape} came; equal rows are expected"
        )
    fit = fit_design_model(v, f)
    residual = f - design_force(v, fit.coefficient, fit.exponent)
    rms = float(np.sqrt(np.mean(f**2)))
    acceleration = np.gradient(v, t)
    moving = (np.abs(v) > 0.05 * np.abs(v).max()) & (np.abs(f) > 0.02 * np.abs(f).max())
    opposed = float(np.mean(f[moving] * v[moving] < 0.0)) if np.any(moving) else 0.0
    bins, rising, falling, width = _loop(v, acceleration, f, n_bins)
    share, f_statistic, p_value = _lack_of_fit(x, v, acceleration, f, residual)
    reasons = _objections(fit, opposed, width / rms, share, f_statistic, p_value)
    return TrustReport(
        trusted=not reasons,
        reasons=reasons,
        fit=fit,
        opposed=opposed,
        loop_width=width / rms,
        memory_share=share,
        f_statistic=f_statistic,
        p_value=p_value,
        velocity_bins=bins,
        accelerating=rising,
        decelerating=falling,
    )


def _objections(
    fit: DesignFit, opposed: float, loop_width: float, memory_share: float, f_statistic: float, p_value: float
) -> tuple[str, ...]:
    """What speaks against the design model, one sentence each; the arguments are those of `TrustReport`."""
    reasons = []
    if fit.nmse > SETTINGS.good_fit:
        reasons.append(
            f"the best design model misses the force by {fit.nmse:.1f} % NMSE ({SETTINGS.good_fit:g} % is a good fit)"
        )
    if opposed > SETTINGS.opposed_limit:
        reasons.append(f"in {100 * opposed:.1f} % of the moving samples the damper pushes along its velocity")
    if loop_width > SETTINGS.loop_limit:
        reasons.append(
            f"force against velocity is a loop, {100 * loop_width:.0f} % of the rms force in half width: "
            "the force depends on more than the velocity"
        )
    if memory_share > SETTINGS.memory_limit and p_value < 1e-3:
        reasons.append(
            f"displacement and acceleration explain {memory_share:.1f} % of the force beyond velocity (F = {f_statistic:.1f}): "
            "stiffness, inertia or memory"
        )
    return tuple(reasons)


def _loop(
    v: NDArray[np.float64], a: NDArray[np.float64], f: NDArray[np.float64], n_bins: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Mean force over velocity, by the sign of the acceleration; half width weighted by the samples of a bin."""
    edges = np.linspace(-np.abs(v).max(), np.abs(v).max(), n_bins + 1)
    index = np.clip(np.searchsorted(edges, v, side="right") - 1, 0, n_bins - 1)
    means = []
    counts = []
    for branch in (a > 0.0, a <= 0.0):
        number = np.bincount(index[branch], minlength=n_bins)
        total = np.bincount(index[branch], weights=f[branch], minlength=n_bins)
        means.append(np.where(number >= 5, total / np.maximum(number, 1), np.nan))
        counts.append(number)
    both = np.isfinite(means[0]) & np.isfinite(means[1])
    weight = np.minimum(counts[0], counts[1])[both]
    gap = 0.5 * (means[0] - means[1])[both]
    width = float(np.sqrt(np.sum(weight * gap**2) / np.sum(weight))) if np.any(weight) else 0.0
    return 0.5 * (edges[1:] + edges[:-1]), means[0], means[1], width


def _lack_of_fit(
    x: NDArray[np.float64],
    v: NDArray[np.float64],
    a: NDArray[np.float64],
    f: NDArray[np.float64],
    residual: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Share of the variance that x and a explain beyond any odd curve of v, with F statistic and probability."""
    u = v / np.abs(v).max()
    # A wrong shape of the curve is the misfit's business; here the curve is as free as six terms make it.
    curve = np.column_stack([np.ones_like(u), u, u**3, u**5, u * np.abs(u), np.sign(u) * np.sqrt(np.abs(u))])
    more = np.column_stack([x / np.abs(x).max(), a / np.abs(a).max(), (x / np.abs(x).max()) ** 3])
    narrow = residual - curve @ np.linalg.lstsq(curve, residual)[0]
    both = np.column_stack([curve, more])
    wide = residual - both @ np.linalg.lstsq(both, residual)[0]
    before, after = float(np.sum(narrow**2)), float(np.sum(wide**2))
    share = 100.0 * (before - after) / (f.size * float(np.var(f)))
    if after <= 1e-24 * float(np.sum(f**2)):
        return share, (math.inf if share > 0.0 else 0.0), (0.0 if share > 1e-12 else 1.0)
    correlation = float(np.clip(np.sum(wide[1:] * wide[:-1]) / after, 0.0, 0.999999))
    independent = f.size * (1.0 - correlation) / (1.0 + correlation)
    freedom = max(independent - both.shape[1], 1.0)
    statistic = (before - after) / more.shape[1] / (after / freedom)
    return share, float(statistic), float(stats.f.sf(statistic, more.shape[1], freedom))


def _pair(velocity: ArrayLike, force: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
