"""Test set-ups: how a system is driven, and what is measured of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from bench.arrays import Array
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.time_stepping import Drive, component_force, march

Signals = dict[str, Array]
"""Samples (n_samples,) of each signal of a record, in SI units, without noise."""


class System(NamedTuple):
    """What is tested: its properties, and how its drive and its displacement transducer depart from what is stated of them."""

    properties: Properties
    delay_samples: int = 0
    """Samples by which a command reaches the drive too late."""
    displacement_gain: float = 1.0
    """Displacement as it reads over the true one."""


class Excited(NamedTuple):
    """How a record is excited."""

    samples: Array
    """Load, target or prescribed motion (n,), in SI units."""
    rate: int
    """Sample rate of what is recorded [Hz]."""
    start: float = 0.0
    """Displacement [m] from which the system is released at rest."""


@dataclass(frozen=True, kw_only=True)
class Setup(ABC):
    """A test set-up.

    Attributes:
        response: Signal by which sizes of effects are judged.
        motion: Signal whose peak is the size of a record.
        scaled: Whether the load of a record is scaled until the motion has the wanted peak; else that is the peak of the excitation.
    """

    response: str = "displacement"
    motion: ClassVar[str] = "displacement"
    scaled: ClassVar[bool] = True

    def excitation_steps(self, rate: int) -> int:
        """Samples of the excitation for a sample that is recorded."""
        return 1

    def excitation(self, rng: np.random.Generator, samples: Array, peak: float) -> Array:
        """An excitation (n,) of unit size as this set-up makes it, to be multiplied by a peak."""
        return samples

    @abstractmethod
    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """What is measured of a system, which is integrated with some steps a sample."""


@dataclass(frozen=True, kw_only=True)
class LoadCell(Setup):
    """A force, linear between its samples, drives a mass; a load cell measures it."""

    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """As of `Setup.signals`."""
        samples, rate, start = excited
        moved = march(system.properties, samples, float(rate), substeps, start, Drive())
        displacement = moved.displacement * system.displacement_gain
        return {"displacement": displacement, "acceleration": moved.acceleration, "load": samples}


@dataclass(frozen=True, kw_only=True)
class ShakenBase(Setup):
    """An acceleration of the base drives a mass; the displacement is that relative to the base."""

    response: str = "acceleration"

    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """As of `Setup.signals`."""
        p, base = system.properties, excited.samples
        moved = march(p, -p.mass * base, float(excited.rate), substeps, 0.0, Drive())
        return {"displacement": moved.displacement, "acceleration": moved.acceleration + base, "base": base}


@dataclass(frozen=True, kw_only=True)
class CascadeController(Setup):
    """A position and a velocity loop make the force from targets; it is held from sample to sample.

    Attributes:
        velocity_gain: Of the velocity loop [N s/m].
        position_gain: Of the position loop [1/s].
        encoder_noise: Standard deviation [m] of what the encoder adds to the position that the controller reads.
    """

    response: str = "load"
    scaled: ClassVar[bool] = False
    velocity_gain: float
    position_gain: float
    encoder_noise: float = 1e-5

    def excitation(self, rng: np.random.Generator, samples: Array, peak: float) -> Array:
        """As of `Setup.excitation`; noise of the encoder acts like noise of the target."""
        return samples + rng.standard_normal(len(samples)) * self.encoder_noise / peak

    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """As of `Setup.signals`."""
        drive = Drive(True, self.velocity_gain, self.position_gain)
        moved = march(system.properties, excited.samples, float(excited.rate), substeps, 0.0, drive)
        return {"displacement": moved.displacement, "load": moved.load}


@dataclass(frozen=True, kw_only=True)
class PositionServo(Setup):
    """A servo holds each target until the next; stiffness and damping of the system include the servo's.

    Attributes:
        gain: Of the position [N m/rad].
    """

    scaled: ClassVar[bool] = False
    gain: float

    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """As of `Setup.signals`."""
        targets = excited.samples
        late = np.concatenate([np.full(system.delay_samples, targets[0]), targets])[: len(targets)]
        drive = Drive(held=True)
        moved = march(system.properties, self.gain * late, float(excited.rate), substeps, 0.0, drive)
        return {"displacement": moved.displacement, "load": targets}


@dataclass(frozen=True, kw_only=True)
class TestingMachine(Setup):
    """A machine prescribes the displacement of a component, whose force is measured."""

    __test__: ClassVar[bool] = False
    response: str = "force"
    scaled: ClassVar[bool] = False

    def excitation_steps(self, rate: int) -> int:
        """As of `Setup.excitation_steps`: some 20 kHz."""
        return max(8, math.ceil(20_000 / rate))

    def signals(self, system: System, excited: Excited, substeps: int) -> Signals:
        """As of `Setup.signals`, but with the steps of the excitation."""
        x, rate = excited.samples, excited.rate
        steps = self.excitation_steps(rate)
        force = component_force(
            system.properties, x, np.gradient(x, 1.0 / (rate * steps)), float(rate), steps
        )
        return {"displacement": x[::steps][: len(force)], "force": force}
