"""A joint rig: two bodies on mounts, coupled by a joint, under a force along the axis and a torque about it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.case import (
    Case,
    Record,
    Signals,
    Simulated,
    Sizes,
    Specimen,
    of_validation,
)
from third_laboratory_cases.joint_rig import Axis, Swing, march
from third_laboratory_cases.linear import axis_response
from third_laboratory_cases.signals import Excitation
from third_laboratory_cases.sizing import background_factor, left_after_fit, rms

Direction = Literal["axial", "torsional"]
RESPONSES: dict[Direction, tuple[str, str]] = {
    "axial": ("displacement_1", "displacement_2"),
    "torsional": ("rotation_1", "rotation_2"),
}
"""Signals of the motion along the axis and about it."""
LOADS: dict[Direction, str] = {"axial": "force", "torsional": "torque"}
ACCELERATIONS = ("acceleration_1", "acceleration_2", "angular_acceleration_1", "angular_acceleration_2")
RELATIVE = {
    "mass_1": 0.01, "mount_stiffness_1": 0.015, "mount_damping_1": 0.1,
    "mass_2": 0.01, "mount_stiffness_2": 0.015, "mount_damping_2": 0.1,
    "joint_stiffness": 0.04, "joint_damping": 0.2,
}  # fmt: skip
"""What may be stated along and about the axis, in the rig's order, and its standard deviation as a fraction of the true value."""


class SmallPhysics(NamedTuple):
    """Small physics that no nominal model has."""

    carried_mass: float = 0.0
    """Part of body 2 that is mounted on the rest by a spring along the axis, as a fraction of its mass."""
    carried_frequency: float = 1.0
    """Its natural frequency [Hz]."""
    carried_inertia: float = 0.0
    """Part of body 1 that is mounted on the rest by a spring about the axis, as a fraction of its inertia."""
    turning_frequency: float = 1.0
    """Its natural frequency [Hz]."""
    swing: float = 0.0
    """Slow swing of the mounts of body 1, as a fraction of their stiffness."""
    swing_frequency: float = 0.0
    """Its frequency [Hz]."""
    friction: float = 0.0
    """Coulomb friction of the joint along the axis [N]."""
    turning_friction: float = 0.0
    """The same about it [N m]."""


class Excited(NamedTuple):
    """A record as it is excited, on the fine clock."""

    record: Record
    h: float
    """Its step [s]."""
    force: Array
    """Force on body 1 [N] (n,)."""
    torque: Array
    """Torque on body 1 [N m] (n,)."""


def tuned(
    mass_1: float,
    mass_2: float,
    frequency_1: float,
    frequency_2: float,
    joint: float,
    ratio: float = 0.03,
) -> Axis:
    """Properties along an axis or about it.

    Args:
        mass_1: Mass or inertia of body 1 [kg, kg m^2].
        mass_2: The same of body 2.
        frequency_1: Natural frequency of body 1 on its mount without the joint [Hz].
        frequency_2: The same of body 2.
        joint: Stiffness of the joint over that of the mount of body 1; its damping is 0.35 of what follows alike.
        ratio: Damping ratio of the mounts.
    """
    stiffness_1, stiffness_2 = (
        m * (2.0 * math.pi * f) ** 2 for m, f in ((mass_1, frequency_1), (mass_2, frequency_2))
    )
    damping_1, damping_2 = (
        2.0 * ratio * math.sqrt(k * m) for k, m in ((stiffness_1, mass_1), (stiffness_2, mass_2))
    )
    joint_damping = 0.35 * joint * damping_1
    return Axis(
        mass_1, mass_2, stiffness_1, stiffness_2, damping_1, damping_2, joint * stiffness_1, joint_damping
    )


@dataclass(frozen=True, kw_only=True)
class JointRig(Specimen):
    """A joint rig.

    Attributes:
        axial: Properties along the axis as a nominal model has them, with true values.
        torsional: The same about the axis.
        missing_axial: Properties along the axis that differ, by name.
        missing_torsional: The same about the axis.
        cross: Stiffness that couples extension and twist of the joint [N/rad], which is missing.
        background: Small physics besides, whose size is sought.
        judged: Along which motion sizes are judged, by the body where they are larger.
    """

    axial: Axis
    torsional: Axis
    missing_axial: Mapping[str, float] = field(default_factory=dict)
    missing_torsional: Mapping[str, float] = field(default_factory=dict)
    cross: float = 0.0
    background: SmallPhysics
    judged: Direction = "axial"

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        along = {f"axial {name}": getattr(self.axial, name) for name in RELATIVE}
        return {**along, **{f"torsional {name}": getattr(self.torsional, name) for name in RELATIVE}}

    def complete(self) -> tuple[Axis, Axis]:
        """Properties along the axis and about it, with what is missing."""
        return self.axial._replace(**self.missing_axial), self.torsional._replace(**self.missing_torsional)

    def signals(
        self, case: Case, excited: Excited, factor: float, stride: int = 1, *, complete: bool = True
    ) -> Signals:
        """Signals of a record, with the background times a factor, integrated at each `stride`-th step."""
        axial, torsional = self.complete() if complete else (self.axial, self.torsional)
        b = self.background
        axial = axial._replace(
            friction=axial.friction + factor * b.friction,
            resonator_2=factor * b.carried_mass * axial.mass_2,
            resonator_frequency=b.carried_frequency,
        )
        torsional = torsional._replace(
            friction=torsional.friction + factor * b.turning_friction,
            resonator_1=factor * b.carried_inertia * torsional.mass_1,
            resonator_frequency=b.turning_frequency,
        )
        h, swing = stride * excited.h, Swing(factor * b.swing, b.swing_frequency)
        force, torque = excited.force[::stride], excited.torque[::stride]
        x, v = march(axial, torsional, self.cross if complete else 0.0, swing, force, torque, h)
        every = slice(None, None, case.substeps // stride)
        motion = zip((*RESPONSES["axial"], *RESPONSES["torsional"]), x[every].T, strict=True)
        accelerations = zip(ACCELERATIONS, np.gradient(v, h, axis=0)[every].T, strict=True)
        loads = {"force": force[every], "torque": torque[every]}
        return {**loads, **dict(motion), **dict(accelerations)}

    def excited(self, case: Case, record: Record, rng: np.random.Generator) -> Excited:
        """A record whose loads give the wanted peaks of body 1 in the linear model."""
        t = record.times(case.rate * case.substeps)

        def load(excitation: Excitation, axis: Axis, peak: float) -> Array:
            y = excitation(rng, t)
            if not y.any():
                return y
            return y * peak / np.max(np.abs(axis_response(axis, y[:: case.substeps], case.rate)[0]))

        axial, torsional = self.complete()
        force = load(record.excitation, axial, record.peak)
        return Excited(record, t[1], force, load(record.torque, torsional, record.torque_peak))

    def simulated(self, case: Case, rng: np.random.Generator) -> Simulated:
        """As of `Specimen.simulated`."""
        excited = {record.stem: self.excited(case, record, rng) for record in case.records}
        judged = {stem: each for stem, each in excited.items() if each.record.validates()}
        names = RESPONSES[self.judged]

        def run(factor: float, stride: int = 1, *, complete: bool = True) -> dict[str, Signals]:
            return {
                stem: self.signals(case, each, factor, stride, complete=complete)
                for stem, each in judged.items()
            }

        full = run(0.0)
        sizes = {name: float(np.std(of_validation(case, full, name))) for name in names}

        def apart(some: Mapping[str, Signals], others: Mapping[str, Signals]) -> float:
            return max(
                rms(of_validation(case, some, name) - of_validation(case, others, name)) / sizes[name]
                for name in names
            )

        read = {stem: case.transmitted(each) for stem, each in full.items()}
        effect = apart(read, run(0.0, complete=False))
        stride = 1 if case.substeps % 3 else case.substeps // 3
        alone = run(0.0, stride)
        factor = background_factor(
            lambda factor: apart(run(factor, stride), alone), case.background_share, tries=4, tolerance=0.15
        )
        moved = {stem: self.signals(case, each, factor) for stem, each in excited.items()}
        background = apart(moved, full)
        signals = {stem: case.transmitted(each) for stem, each in moved.items()}
        for each in signals.values():
            each["drift_2"] = each["displacement_2"] - each["displacement_1"]
        left = left_by_nominal(case, self.judged, signals, sizes)
        return Simulated(signals, Sizes(effect, background, left))


def left_by_nominal(
    case: Case, direction: Direction, signals: Mapping[str, Signals], sizes: Mapping[str, float]
) -> float:
    """NRMSE that the fitted nominal model leaves of the motion along the axis or about it."""

    def errors(values: Mapping[str, float], validating: bool) -> Array:
        axis = Axis(**{name: values[f"{direction} {name}"] for name in RELATIVE})
        found = []
        for record in case.records:
            if record.validates() == validating:
                each = signals[record.stem]
                moved = axis_response(axis, each[LOADS[direction]], case.rate)
                for name, x in zip(RESPONSES[direction], moved, strict=True):
                    found.append((each[name] - x) / sizes[name])
        return np.concatenate(found)

    return left_after_fit(case, errors)
