"""The filter and smoother of a structure whose missing forces are states, with stationary gains.

References:
    E. K. W. Chu, H. Y. Fan, W. W. Lin, A structure-preserving doubling algorithm for periodic discrete-time algebraic
    Riccati equations, Linear Algebra and its Applications 396 (2005).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.settings import LocalisationSettings

DOUBLINGS = 40

_jit = numba.njit(cache=True, error_model="numpy", nogil=True)


class AugmentedModel(NamedTuple):
    """Discrete model of the structure with its missing forces, in scaled states.

    Attributes:
        transition: (d, d).
        drive: Two (d, n_loads): load at the start of a step, and its change over it.
        process: Process noise of the loads (d, d).
        walk: (n_places, d, d) process noise of a walk of unit intensity at each place.
        observe: (m, d), channels in units of their noise.
        feed: (m, n_loads) direct part of the loads in the channels.
        size: (m,) noise of the channels.
        scale: (d,) physical over scaled states.
    """

    transition: Array
    drive: tuple[Array, Array]
    process: Array
    walk: Array
    observe: Array
    feed: Array
    size: Array
    scale: Array


class Gains(NamedTuple):
    """Stationary gains of filter and smoother, and the covariance of the innovations."""

    forward: Array
    backward: Array
    innovation: Array


@_jit
def _filter(y, drive, transition, observe, gain, start, filtered, predicted):
    n, m = y.shape
    d = transition.shape[0]
    squares = np.zeros((m, m))
    innovation = np.zeros(m)
    state = start.copy()
    skipped = n // 20
    for k in range(n):
        if k > 0:
            for i in range(d):
                total = drive[k - 1, i]
                for j in range(d):
                    total += transition[i, j] * filtered[k - 1, j]
                state[i] = total
        for i in range(d):
            predicted[k, i] = state[i]
        for c in range(m):
            innovation[c] = y[k, c]
            for i in range(d):
                innovation[c] -= observe[c, i] * state[i]
        for i in range(d):
            total = state[i]
            for c in range(m):
                total += gain[i, c] * innovation[c]
            filtered[k, i] = total
        if k > skipped:
            for c in range(m):
                for e in range(m):
                    squares[c, e] += innovation[c] * innovation[e]
    return squares / (n - 1 - skipped)


@_jit
def _smooth(filtered, predicted, back):
    d = filtered.shape[1]
    ahead = np.zeros(d)
    for k in range(filtered.shape[0] - 2, -1, -1):
        for i in range(d):
            ahead[i] = filtered[k + 1, i] - predicted[k + 1, i]
        for i in range(d):
            for j in range(d):
                filtered[k, i] += back[i, j] * ahead[j]


def exponential(a: Array) -> Array:
    """Matrix exponential by scaling, Taylor's series and squaring; for these small matrices ten times faster than SciPy's."""
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(a).sum(axis=0).max(), 1e-300)))) + 2)
    small = a / 2.0**halvings
    term = out = np.eye(len(a))
    for k in range(1, 13):  # 0.25^13 / 13! is below the rounding error
        term = term @ small / k
        out = out + term
    for _ in range(halvings):
        out = out @ out
    return out


def _riccati(transition: Array, observe: Array, process: Array) -> Array:
    """Stationary covariance of the prediction under unit noise, by doubling: sure even next to the unit circle."""
    a = transition.T.copy()
    g = observe.T @ observe
    h = process.copy()
    eye = np.eye(len(a))
    for _ in range(DOUBLINGS):
        inner = np.linalg.solve(eye + g @ h, np.hstack([a, g]))
        a_inner, g_inner = inner[:, : len(a)], inner[:, len(a) :]
        # (I + G H)^-1 on the left of A and G; H (I + G H)^-1 is symmetric because G and H are
        new_h = h + a.T @ h @ a_inner
        g = g + a @ g_inner @ a.T
        a = a @ a_inner
        settled = np.abs(new_h - h).max() <= 1e-12 * np.abs(new_h).max()
        h = 0.5 * (new_h + new_h.T)
        if settled:
            break
    return h


def gains_of(model: AugmentedModel, intensity: Array) -> Gains:
    """Stationary gains where the walks have an intensity (n_places,)."""
    process = model.process + np.tensordot(intensity**2, model.walk, 1)
    covariance = _riccati(model.transition, model.observe, process)
    innovation = model.observe @ covariance @ model.observe.T + np.eye(len(model.size))
    forward = np.linalg.solve(innovation, model.observe @ covariance).T
    posterior = covariance - forward @ model.observe @ covariance
    backward = np.linalg.lstsq(covariance, model.transition @ posterior, rcond=1e-13)[0].T
    return Gains(
        np.ascontiguousarray(forward, np.float64), np.ascontiguousarray(backward, np.float64), innovation
    )


def _signals(model: AugmentedModel, samples: Array, loads: Array) -> tuple[Array, Array]:
    """Channels less the direct part of the loads (n, m), and what the loads add to the state over each step (n, d)."""
    padded = np.zeros((len(samples), len(model.size)))
    padded[:, : samples.shape[1]] = samples
    y = padded / model.size - loads @ model.feed.T
    rise = np.vstack([np.diff(loads, axis=0), np.zeros((1, loads.shape[1]))])
    drive = loads @ model.drive[0].T + rise @ model.drive[1].T
    return np.ascontiguousarray(y), np.ascontiguousarray(drive)


def smoothed(model: AugmentedModel, gains: Gains, samples: Array, loads: Array, start: Array) -> Array:
    """Smoothed states (n, d) in physical units."""
    y, drive = _signals(model, samples, loads)
    filtered = np.zeros((len(y), len(start)))
    predicted = np.zeros_like(filtered)
    _filter(y, drive, model.transition, model.observe, gains.forward, start, filtered, predicted)
    _smooth(filtered, predicted, gains.backward)
    return filtered * model.scale


def tuned(
    model: AugmentedModel,
    samples: Array,
    loads: Array,
    start: Array,
    guess: Array,
    *,
    settings: LocalisationSettings,
) -> Array:
    """Most likely intensity of the walk at each place, one place after the other, twice round where there are several."""
    y, drive = _signals(model, samples[: settings.tuned_on], loads[: settings.tuned_on])
    filtered = np.zeros((len(y), len(start)))
    predicted = np.zeros_like(filtered)

    def score(intensity: Array) -> float:
        gains = gains_of(model, intensity)
        if not np.isfinite(gains.forward).all():
            return np.inf
        observed = _filter(
            y, drive, model.transition, model.observe, gains.forward, start, filtered, predicted
        )
        _, logarithm = np.linalg.slogdet(gains.innovation)
        total = float(logarithm + np.trace(np.linalg.solve(gains.innovation, observed)))
        return total if np.isfinite(total) else np.inf

    best = guess.copy()
    for _ in range(1 if len(guess) == 1 else 2):
        for j in range(len(guess)):
            trials = []
            for multiple in settings.walk_intensities:
                trial = best.copy()
                trial[j] = multiple * guess[j]
                trials.append((score(trial), multiple * guess[j]))
            best[j] = min(trials)[1]
    return best
