"""From what drives a rig to the commands of its actuators."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.recording import Recording
from bench.rig.description import Rig
from bench.signals import Excitation
from bench.signals.base import (
    BASE_SETTINGS,
)

Drive = Excitation | Recording | Mapping[str, ArrayLike]
"""What drives a rig: a designed excitation, a record with a channel per actuator, or arrays by actuator name."""
Initial = Mapping[str, tuple[float, float]]
"""(position, velocity) by joint at the start; at rest where not given."""


def controls_of(rig: Rig, drive: Drive, rng: np.random.Generator | None = None) -> NDArray[np.float64]:
    """Commands of the rig's actuators, one row a time step ``(n, n_actuators)``; actuators not driven get zero.

    Args:
        rig: The rig.
        drive: Excitation, record or arrays by actuator name. A record's sample rate must divide the step rate.
        rng: Source of randomness of an excitation.

    Raises:
        UnknownNameError: The drive names an actuator that the rig lacks.
        ParameterError: Not finite, or of different lengths, or a sample rate that does not divide the step rate.
    """
    columns, rate = _columns(rig, drive, rng)
    for name in columns:
        if name not in rig.actuators:
            raise UnknownNameError(f"actuator of rig '{rig.name}'", name, rig.actuators)
    hold = whole_steps(rate, rig)
    if hold < 1:
        raise ParameterError(
            f"a sample rate of {rate:g} Hz does not divide the {1.0 / rig.timestep:g} steps a second of rig '{rig.name}'; "
            "resample the drive or set the rig's timestep"
        )
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise ParameterError(
            f"the drive of rig '{rig.name}' has channels of different lengths: {sorted(lengths)} samples"
            if lengths
            else f"the drive of rig '{rig.name}' has no channels; one of {', '.join(rig.actuators)} at least is expected"
        )
    length = lengths.pop()
    if length < 1:
        raise ParameterError(f"the drive of rig '{rig.name}' has no samples; at least one is expected")
    if length * hold > BASE_SETTINGS.max_samples:
        raise ParameterError(
            f"{length} samples, each held for {hold} steps of rig '{rig.name}', are {length * hold} steps; "
            f"at most {BASE_SETTINGS.max_samples} "
            "are expected: lengthen the timestep, or make several records"
        )
    controls = np.zeros((length * hold, len(rig.actuators)))
    for name, values in columns.items():
        if not np.all(np.isfinite(values)):
            at = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ParameterError(
                f"the command of actuator '{name}' is {values[at]} at sample {at}; finite numbers are expected"
            )
        controls[:, rig.actuators.index(name)] = np.repeat(values, hold)
    return controls


def _columns(
    rig: Rig, drive: Drive, rng: np.random.Generator | None
) -> tuple[dict[str, NDArray[np.float64]], float]:
    """Commands by actuator as a drive has them, and their rate [Hz]."""
    if isinstance(drive, Excitation):
        samples = drive.sample(rng if rng is not None else np.random.default_rng())
        columns = dict(zip(drive.names, samples.T, strict=True))
        rate = drive.sample_rate
    elif isinstance(drive, Recording):
        columns = {name: drive[name] for name in rig.actuators if name in drive.names}
        rate = drive.sample_rate
        if not columns:
            raise UnknownNameError(
                f"channel for the actuators of rig '{rig.name}' in the record", rig.actuators[0], drive.names
            )
    elif isinstance(drive, Mapping):
        columns = {name: _command(name, values) for name, values in drive.items()}
        rate = 1.0 / rig.timestep
    else:
        raise ParameterError(
            f"the drive of rig '{rig.name}' is a {type(drive).__name__}; an excitation, a record or arrays by actuator name are expected"
        )
    return columns, rate


def _command(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Commands of one actuator (n,)."""
    try:
        samples = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(
            f"the command of actuator '{name}' is no array of real numbers; (n,) of them are expected"
        ) from None
    if samples.ndim != 1:
        raise ParameterError(
            f"the command of actuator '{name}' has the shape {samples.shape}; (n,) is expected, one number a time step"
        )
    return samples


def whole_steps(rate: float, rig: Rig) -> int:
    """Steps of a rig in one sample; 0 where they are no whole number, or more than any record has."""
    share = rate * rig.timestep
    if not share * BASE_SETTINGS.max_samples >= 1.0:
        return 0
    steps = round(1.0 / share)
    return steps if abs(steps * share - 1.0) <= 1e-6 else 0
