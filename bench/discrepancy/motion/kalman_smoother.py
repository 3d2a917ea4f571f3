"""Position, velocity and acceleration of one coordinate from what was measured of it.

A Rauch-Tung-Striebel smoother with a random-walk acceleration fuses position, velocity and acceleration channels, whichever
exist. The intensity of the random walk is chosen by the likelihood of the innovations; gains are stationary, so a
record of 20 000 samples costs a few milliseconds.

References:
    H. E. Rauch, F. Tung, C. T. Striebel, AIAA Journal 3 (1965) 1445-1450.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from bench.discrepancy.settings import DEFAULT, MotionSettings
from bench.errors import IdentificationError


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _filter(y, h, transition, gain, start, out, predicted):
    n = y.shape[0]
    m = y.shape[1]
    state = start.copy()
    squares = np.zeros((m, m))
    innovation = np.zeros(m)
    for k in range(n):
        if k > 0:
            s0 = state[0] * transition[0, 0] + state[1] * transition[0, 1] + state[2] * transition[0, 2]
            s1 = state[1] + state[2] * transition[1, 2]
            state[0] = s0
            state[1] = s1
        for i in range(3):
            predicted[k, i] = state[i]
        for c in range(m):
            innovation[c] = y[k, c]
            for i in range(3):
                innovation[c] -= h[c, i] * state[i]
        for c in range(m):
            for i in range(3):
                state[i] += gain[i, c] * innovation[c]
            if k > n // 20:
                for d in range(m):
                    squares[c, d] += innovation[c] * innovation[d]
        for i in range(3):
            out[k, i] = state[i]
    return squares / (n - 1 - n // 20)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _smooth(filtered, predicted, back):
    for k in range(filtered.shape[0] - 2, -1, -1):
        d0 = filtered[k + 1, 0] - predicted[k + 1, 0]
        d1 = filtered[k + 1, 1] - predicted[k + 1, 1]
        d2 = filtered[k + 1, 2] - predicted[k + 1, 2]
        for i in range(3):
            filtered[k, i] += back[i, 0] * d0 + back[i, 1] * d1 + back[i, 2] * d2


def _stationary(
    transition: NDArray, process: NDArray, h: NDArray, noise: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Return stationary predicted covariance, gain and innovation covariance, by doubling-free iteration."""
    scale = np.sqrt(np.diag(noise))
    covariance = np.asarray(solve_discrete_are(transition.T, (h / scale[:, None]).T, process, np.eye(len(h))))
    innovation = h @ covariance @ h.T + noise
    gain = covariance @ h.T @ np.linalg.inv(innovation)
    return covariance, gain, innovation


class Smoother(NamedTuple):
    """A smoother of one coordinate with stationary gains: linear in the samples it is given.

    Attributes:
        step: Time between samples [s].
        powers: (n_channels,) powers of the step that make the channels alike in size.
        observed: (n_channels, 3) ones where a channel measures position, velocity or acceleration.
        transition: (3, 3) from one sample to the next.
        gain: (3, n_channels) of the innovations.
        back: (3, 3) gain of the way back.
        spread: (3, 3) covariance of a state that is told from the samples on one side of it alone, in units of the step.
    """

    step: float
    powers: NDArray
    observed: NDArray
    transition: NDArray
    gain: NDArray
    back: NDArray
    spread: NDArray

    @property
    def one_sided(self) -> NDArray[np.float64]:
        """Covariance (3, 3) of position, velocity and acceleration at either end of a record."""
        units = 1.0 / self.step ** np.arange(3.0)
        return self.spread * np.outer(units, units)

    def smooth(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Position, velocity and acceleration (n, 3) from samples (n, n_channels)."""
        y = np.ascontiguousarray(samples * self.powers)
        measured = len(self.observed) == y.shape[1]
        if not measured:  # the mean position, which nothing measures
            y = np.column_stack([y, np.zeros(len(y))])
        filtered, predicted = np.zeros((len(y), 3)), np.zeros((len(y), 3))
        # where positions are integrals, what a filter finds after the whole record is how far it has drifted
        start = self._start(y) if measured else self.observed.T @ y[0]
        _filter(y, self.observed, self.transition, self.gain, start, filtered, predicted)
        _smooth(filtered, predicted, self.back)
        return filtered / self.step ** np.arange(3.0)

    def _start(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where the motion starts (3,), in units of the step: where a filter ends that goes back from the last sample (n, n_channels).

        A record may start in motion, and stationary gains, which trust the start as if much was known of it, would carry along what
        is wrong with it.
        """
        backwards = np.array([1.0, -1.0, 1.0])  # velocities change sign
        reversed_y = np.ascontiguousarray((y * (self.observed @ backwards))[::-1])
        filtered, predicted = np.zeros((len(y), 3)), np.zeros((len(y), 3))
        guess = self.observed.T @ reversed_y[0]
        _filter(reversed_y, self.observed, self.transition, self.gain, guess, filtered, predicted)
        return filtered[-1] * backwards


def smooth_motion(
    samples: NDArray[np.float64],
    orders: tuple[int, ...],
    noise_std: NDArray[np.float64],
    step: float,
    *,
    settings: MotionSettings = DEFAULT.motion,
) -> NDArray[np.float64]:
    """Fuse the channels of one coordinate: `smoother_of` them, applied to them.

    Args:
        samples: (n, n_channels) measured.
        orders: Derivative that each channel measures: 0, 1 or 2.
        noise_std: (n_channels,) white noise.
        step: Time between samples [s].
        settings: `MotionSettings` of the diagnosis.

    Returns:
        (n, 3) position, velocity, acceleration. Without a position channel the position is the double integral of
        what was measured, from zero.
    """
    still = resting(samples, orders, noise_std, settings=settings)  # a free run that nothing drives
    return (
        smoother_of(samples, orders, noise_std, step, settings=settings).smooth(samples)
        if still is None
        else still
    )


def resting(
    samples: NDArray[np.float64],
    orders: tuple[int, ...],
    noise_std: NDArray[np.float64],
    *,
    settings: MotionSettings,
) -> NDArray[np.float64] | None:
    """The motion (n, 3) where channels show none, not even noise; None otherwise. Arguments as of `smooth_motion`."""
    where = samples[0] * (np.array(orders) == 0)
    if np.any(np.abs(samples - where).max(axis=0) >= settings.rest * noise_std):
        return None
    out = np.zeros((len(samples), 3))
    out[:, 0] = where.sum() / max(orders.count(0), 1)
    return out


def smoother_of(
    samples: NDArray[np.float64],
    orders: tuple[int, ...],
    noise_std: NDArray[np.float64],
    step: float,
    *,
    settings: MotionSettings,
) -> Smoother:
    """The likeliest smoother of the channels of one coordinate; arguments as of `smooth_motion`.

    Raises:
        IdentificationError: The channels cannot be fused.
    """
    powers = step ** np.array(orders, dtype=float)
    y = np.ascontiguousarray(samples * powers)
    noise_scaled = noise_std * powers
    guess = _jerk_guess(samples, orders, noise_std, step) * step**5
    if 0 not in orders:
        # Nothing fixes the mean position: a position of zero, known very poorly, keeps the integration from drifting.
        lowest = min(orders)
        omega = 2.0 * np.pi * _band(samples[:, orders.index(lowest)], noise_std[orders.index(lowest)], step)
        reach = float(np.std(samples[:, orders.index(lowest)])) / omega**lowest
        orders = (*orders, 0)
        y = np.ascontiguousarray(np.column_stack([y, np.zeros(len(y))]))
        noise_scaled = np.append(noise_scaled, settings.loose * reach)
    h = np.zeros((len(orders), 3))
    for c, order in enumerate(orders):
        h[c, order] = 1.0
    # In units of the step, position, velocity times step and acceleration times step squared are alike in size: the
    # Riccati equation is hopeless in SI units.
    transition = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    shape = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])
    noise = np.diag(noise_scaled**2)
    best: tuple[float, Smoother] | None = None
    for multiple in settings.jerk_intensities:
        process = shape * guess * multiple
        try:
            covariance, gain, innovation = _stationary(transition, process, h, noise)
        except (np.linalg.LinAlgError, ValueError):
            continue
        gain = np.ascontiguousarray(gain)
        observed = _filter(y, h, transition, gain, h.T @ y[0], np.zeros((len(y), 3)), np.zeros((len(y), 3)))
        score = np.linalg.slogdet(innovation)[1] + np.trace(np.linalg.solve(innovation, observed))
        if np.isfinite(score) and (best is None or score < best[0]):
            posterior = covariance - gain @ h @ covariance
            back = np.ascontiguousarray(posterior @ transition.T @ np.linalg.inv(covariance))
            best = (score, Smoother(step, powers, h, transition, gain, back, posterior))
    if best is None:
        raise IdentificationError(
            "the channels of one coordinate could not be fused; check the noise stated for them and their units"
        )
    return best[1]


def _jerk_guess(samples: NDArray, orders: tuple[int, ...], noise_std: NDArray, step: float) -> float:
    """Intensity of the white jerk that the measured signals suggest, over the band in which they stand above the noise."""
    order = max(orders)
    c = orders.index(order)
    omega = 2.0 * np.pi * _band(samples[:, c], noise_std[c], step)
    return float(np.var(samples[:, c]) * omega ** (2 * (3 - order)) / omega)


def _band(samples: NDArray, noise_std: float, step: float) -> float:
    """Mean frequency [Hz] of the part of a signal that stands above its noise."""
    x = samples - samples.mean()
    spectrum = np.abs(np.fft.rfft(x)) ** 2 / len(x)
    frequency = np.fft.rfftfreq(len(x), step)
    strong = spectrum > 10.0 * noise_std**2
    if not strong.any():
        return 1.0
    return max(float(np.average(frequency[strong], weights=spectrum[strong])), 1.0 / (len(x) * step))
