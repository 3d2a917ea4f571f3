"""Whether the design model may be used for a damper: what speaks against it in the motion recorded."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bench.errors import RecordingError
from bench.identification.damper import SETTINGS, DesignFit, design_force, fit_design_model, paired


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
    v, f = paired(velocity, force)
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
