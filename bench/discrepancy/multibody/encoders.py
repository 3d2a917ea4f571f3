"""Encoders and inputs of the joints of a case: which channels they are, their noise, and what may be wrong with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numba
import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.multibody.joints import Joint
from bench.errors import FileFormatError


@dataclass(frozen=True)
class EncodersSettings:
    """Numbers of `bench.discrepancy.multibody.encoders`."""

    orders: Mapping[str, int] = field(default_factory=lambda: {"position": 0, "velocity": 1})
    """Derivatives of the position by the quantity of a channel."""


SETTINGS = EncodersSettings()


class Encoder(NamedTuple):
    """What is wrong with the log of a joint: ``logged = (1 + gain) true(t - delay) + offset``, its velocity ``(1 + speed) true``.

    A servo may act on the wrong reading (``in_loop`` of one), or have a right one of its own (zero).
    """

    offset: float = 0.0
    gain: float = 0.0
    delay: float = 0.0
    speed: float = 0.0
    in_loop: float = 0.0

    def corrected(self, samples: Array, orders: Sequence[int]) -> Array:
        """True samples (n, n_channels) behind logged ones of the given orders (0 position, 1 velocity), the delay left in."""
        out = np.array(samples)
        for c, order in enumerate(orders):
            if order == 0:
                out[:, c] = (out[:, c] - self.offset) / (1.0 + self.gain)
            else:
                out[:, c] /= 1.0 + self.speed
        return out

    def scaled(self, noise: Array, orders: Sequence[int]) -> Array:
        """Noise of the corrected samples."""
        factors = [abs(1.0 + (self.gain if order == 0 else self.speed)) for order in orders]
        return noise / np.array(factors)


TRUE = Encoder()
"""An encoder with nothing wrong."""


class Encoders(NamedTuple):
    """The encoders of a joint.

    Attributes:
        channels: Its channels, by increasing order.
        orders: (n_channels,) 0 or 1.
        noise: (n_channels,).
    """

    channels: tuple[CaseChannel, ...]
    orders: tuple[int, ...]
    noise: Array


def travel(case: Case, joint: Joint, noise: float) -> float:
    """What errors of a joint's position are divided by: its motion, RMS over all records of the case, at least the noise.

    A joint that rests in one record is not off by more for that.
    """
    (channel, *_) = encoders_of(case, joint).channels
    moved = [np.var(r.values[channel.name]) for r in (*case.identification, *case.validation)]
    return max(float(np.sqrt(np.mean(moved))), noise)


def encoders_of(case: Case, joint: Joint) -> Encoders:
    """The channels that measure a joint.

    Raises:
        FileFormatError: Its position is not measured.
    """
    found = {}
    for channel in case.channels:
        if channel.role == "response" and channel.target == f"joint:{joint.name}":
            if channel.quantity not in SETTINGS.orders:
                raise FileFormatError(
                    f"channel '{channel.name}' has the quantity '{channel.quantity}'; position or velocity of a joint is expected"
                )
            found[SETTINGS.orders[channel.quantity]] = channel
    if 0 not in found:
        raise FileFormatError(
            f'nothing measures the position of joint \'{joint.name}\'; give a channel "joint": "{joint.name}", '
            '"quantity": "position", or say by "joints" that it was held'
        )
    channels = tuple(found[order] for order in sorted(found))
    noise = np.array([noise_of(channel) for channel in channels])
    return Encoders(channels, tuple(sorted(found)), noise)


def noise_of(channel: CaseChannel) -> float:
    """Noise of an encoder: as stated, at least that of its resolution."""
    return max(channel.noise_std or 0.0, channel.resolution / np.sqrt(12.0))


@numba.njit(cache=True)
def _runs(readings, resolution):
    """Number (n,) of the run that every reading belongs to: a run goes on while its readings lie within one step."""
    run = np.zeros(len(readings), dtype=np.int64)
    low = high = readings[0]
    for i in range(1, len(readings)):
        low, high = min(low, readings[i]), max(high, readings[i])
        run[i] = run[i - 1]
        if high - low > 1.5 * resolution:
            low = high = readings[i]
            run[i] += 1
    return run


def weight_of_readings(readings: Array, resolution: float, noise: float) -> Array:
    """Weight (n,) of an encoder's readings (n,): how far each tells something that the others do not.

    While a reading stays the same, its error of quantisation does. Of ``L`` equal readings in a row the mean has the variance
    ``noise^2 (s + (1 - s) / L)``, with the part ``s`` of the variance that is the step's; each counts by the root of one L-th
    of the inverse of that, in units of the noise. Where the motion crosses steps between samples these are white and weigh one.
    Beside a torque that is noisy by more than a step moves the joint, a step matters little.

    A reading that noise throws to and fro between two values stays the same, too: counted as short runs, those near the edge of a step,
    whose errors are largest, would weigh most. So a run holds two neighbouring values, and of a motion that goes on it holds two steps.

    Args:
        readings: As logged.
        resolution: Step of the encoder; zero where none is stated.
        noise: Standard deviation of what the readings are held against, the step's included: of their innovations.

    References:
        B. Widrow and I. Kollar, *Quantization Noise*, 2008, chapter 6 (correlation of the error of quantisation).
    """
    if resolution <= 0.0 or noise <= 0.0:
        return np.ones(len(readings))
    run = _runs(np.ascontiguousarray(readings, dtype=np.float64), resolution)
    length = np.maximum(0.5 * np.bincount(run)[run], 1.0)
    share = min(resolution**2 / 12.0 / noise**2, 1.0)
    return np.asarray(1.0 / np.sqrt(1.0 + share * (length - 1.0)), dtype=np.float64)


def weights_of(case: Case, record: CaseRecord, joint: Joint, innovations: Array) -> Array:
    """Weights (n, n_measured) of the readings of a joint, whose innovations have the standard deviations (n_measured,)."""
    return np.column_stack(
        [
            weight_of_readings(record.values[channel.name], channel.resolution, float(level))
            for channel, level in zip(encoders_of(case, joint).channels, innovations, strict=True)
        ]
    )
