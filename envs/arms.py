"""Places with a user's own MuJoCo model: joints, their ranges and drives, what of them is unknown, and what may be asked of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.excitation import Limits, RigHypothesis, RigPrior, Uncertain
from bench.rig import Rig
from bench.rig.actuators import JointDrive
from bench.rig.building import parse

from .places import StationSetup


@dataclass(frozen=True)
class ArmsSettings:
    """Numbers of `envs.arms`."""

    interval: float = 0.01
    """Between commands and readings [s], as the controllers of hobby and research arms have it; a model's own step where that is longer."""
    share: float = 0.9
    """Of a joint's range, and of a drive's inputs, that targets may use: servos overshoot."""
    sweep: float = 1.0
    """Largest velocity: a joint's whole range within so many seconds, where none is given."""
    factor: float = 2.0
    """Range of a parameter about its value in the model, both ways, where none is given."""
    encoder: float = 1e-3
    """Noise of a position as a share of half a joint's range: about an encoder of 10 bit."""
    tachometer: float = 1e-2
    """Noise of a velocity, which is told from positions, as a share of its limit."""
    current: float = 2e-2
    """Noise of a torque, which is told from a motor's current, as a share of its limit."""
    band: tuple[float, float] = (0.1, 2.0)
    """Of steered sines [Hz]; arms of some decimetres follow no faster ones through a useful angle."""
    window: float = 0.1
    duration: float = 10.0


SETTINGS = ArmsSettings()

FIELDS = {
    "damping": "dof_damping",
    "frictionloss": "dof_frictionloss",
    "armature": "dof_armature",
    "stiffness": "jnt_stiffness",
    "mass": "body_mass",
}
"""Quantities that may be unknown, and MuJoCo's fields for them."""
OWN = ("damping", "frictionloss", "armature")
"""Those of driven joints that are unknown where nothing is said."""


@dataclass(frozen=True)
class ArmArguments:
    """What of a place may be asked for; see `envs.model.ModelExcitationEnv`.

    Attributes:
        model: Path of the MJCF.
        uncertain: Ranges of what is unknown, as "damping:elbow".
        ranges: Ranges of joints that have none in the model, or narrower ones [rad or m].
        velocity: Largest velocity of joints [rad/s or m/s].
        torque: Largest torque or force of joints, where the model has none or a larger one [N m or N].
    """

    model: str
    uncertain: Mapping[str, tuple[float, float]]
    ranges: Mapping[str, tuple[float, float]]
    velocity: Mapping[str, float]
    torque: Mapping[str, float]


class Axis:
    """A driven joint and what may be asked of it.

    Attributes:
        joint: The joint.
        drive: Its drive.
        middle: Middle of the range that may be used [rad or m].
        reach: Half of that range [rad or m].
        centre: Input of the drive about which commands are made.
        span: Largest command to either side, in the input's unit.
        speed: Largest velocity [rad/s or m/s].
        torque: Largest torque of the drive at the joint [N m or N]; infinite where there is none.
    """

    def __init__(self, joint: Joint, drive: JointDrive, asked: ArmArguments) -> None:
        self.joint, self.drive = joint, drive
        low, high = _within(joint.name, joint.range, asked.ranges.get(joint.name))
        if not np.isfinite([low, high]).all():
            raise ModelError(
                f"joint '{joint.name}' has no range; give one with ranges={{'{joint.name}': (low, high)}}, in {joint.unit}"
            )
        self.middle, self.reach = 0.5 * (low + high), 0.5 * SETTINGS.share * (high - low)
        ends = (drive.gear * low, drive.gear * high) if drive.servo else (-np.inf, np.inf)
        first, last = max(min(ends), drive.lowest), min(max(ends), drive.highest)
        if not (np.isfinite([first, last]).all() and first < last):
            raise ModelError(
                f"actuator '{drive.name}' has inputs from {first:g} to {last:g}; a ctrlrange with two finite, ascending numbers is expected"
            )
        self.centre, self.span = 0.5 * (first + last), 0.5 * SETTINGS.share * (last - first)
        self.speed = float(asked.velocity.get(joint.name, (high - low) / SETTINGS.sweep))
        own = abs(drive.gear) * min(abs(drive.low), abs(drive.high))
        self.torque = min(own, float(asked.torque.get(joint.name, np.inf)))

    @property
    def channels(self) -> tuple[str, str, str]:
        """Names of its position, velocity and torque."""
        return self.joint.name, f"{self.joint.name}_velocity", f"{self.joint.name}_torque"


def _within(name: str, own: tuple[float, float], asked: tuple[float, float] | None) -> tuple[float, float]:
    """The range of a joint, narrowed to what is asked.

    Raises:
        ParameterError: Nothing of it is left.
    """
    low, high = own if asked is None else (max(own[0], float(asked[0])), min(own[1], float(asked[1])))
    if not low < high:
        raise ParameterError(
            f"the range of joint '{name}' is {asked}, and that of the model {own}; two ascending numbers within the model's are expected"
        )
    return low, high


@dataclass(frozen=True, eq=False)
class ArmSetup(StationSetup):
    """A user's model, of which some parameters are unknown.

    Attributes:
        asked: What was asked for; it travels in place of the setup.
        axes: The driven joints, in the order of commands.
        compiled: The model, with its own integrator.
    """

    asked: ArmArguments
    axes: tuple[Axis, ...]
    compiled: mujoco.MjModel

    def __reduce__(self) -> tuple:
        return (arm_setup, (self.asked,))

    @property
    def rig(self) -> Rig:
        """The model as a rig."""
        return self.hypothesis.rig

    @property
    def hypothesis(self) -> RigHypothesis:
        """What is unknown of it."""
        prior = self.questions[0]
        assert isinstance(prior, RigPrior)
        return prior.hypotheses[0]

    @property
    def substeps(self) -> int:
        """Steps of the model between two commands."""
        return max(1, round(SETTINGS.interval / self.rig.timestep))

    @property
    def timestep(self) -> float:
        """Interval of commands and measurements [s]."""
        return self.substeps * self.rig.timestep

    @property
    def centres(self) -> NDArray[np.float64]:
        """Inputs about which commands are made, by axis ``(n_axes,)``."""
        return np.array([axis.centre for axis in self.axes])

    def fields(self) -> list[tuple[str, int]]:
        """MuJoCo's field and its row for each unknown parameter."""
        found = []
        for name in self.hypothesis.names:
            quantity, _, target = name.partition(":")
            if quantity not in FIELDS:
                raise UnknownNameError("unknown quantity of a model", quantity, FIELDS)
            if quantity == "mass":
                row = self.compiled.body(target).id
            else:
                joint = self.compiled.joint(target)
                row = joint.id if quantity == "stiffness" else int(self.compiled.jnt_dofadr[joint.id])
            found.append((FIELDS[quantity], int(row)))
        return found


def arm_setup(asked: ArmArguments) -> ArmSetup:
    """Read a user's model.

    Args:
        asked: What is asked for.

    Raises:
        ModelError: The model cannot be read, is no arm or leg of hinges and slides on a fixed base, has no drive, or a driven joint or
            drive has no range.
        UnknownNameError: A name is of nothing in the model.
        ParameterError: Nothing is unknown, or a range holds nothing.
    """
    path = Path(asked.model)
    rig = Rig.from_file(path)
    compiled = rig.model
    compiled.opt.integrator = parse(rig.mjcf, str(path.parent), str(path)).option.integrator
    _require_names(compiled, str(path))
    joints = ArticulatedModel.of(compiled, str(path)).joints
    axes = tuple(Axis(joint, joint.drive, asked) for joint in joints if joint.drive is not None)
    if not axes:
        raise ModelError(
            f"no joint of '{path}' has an actuator; at least one joint with a motor or a servo is expected"
        )
    known = [axis.joint.name for axis in axes]
    for name in (*asked.ranges, *asked.velocity, *asked.torque):
        if name not in known:
            raise UnknownNameError(f"driven joint of '{path}'", name, known)
    prior = RigPrior((RigHypothesis(path.stem, rig, _unknown(asked, axes)),))
    noise, stroke, velocity = {}, {}, {}
    for axis in axes:
        position, speed, torque = axis.channels
        noise |= {position: SETTINGS.encoder * axis.reach, speed: SETTINGS.tachometer * axis.speed}
        stroke[position], velocity[speed] = axis.reach, axis.speed
        if np.isfinite(axis.torque):
            noise[torque], velocity[torque] = SETTINGS.current * axis.torque, axis.torque
    scale = stroke | velocity
    limits = Limits({axis.drive.name: axis.span for axis in axes}, {}, stroke, velocity)
    return ArmSetup(
        (prior,), MappingProxyType(noise), limits, MappingProxyType(scale), SETTINGS.band, SETTINGS.window,
        SETTINGS.duration, asked, axes, compiled,
    )  # fmt: skip


def _require_names(model: mujoco.MjModel, path: str) -> None:
    """Raise `ModelError` unless bodies, joints and actuators have names, by which they are spoken of."""
    counts = {"body": model.nbody, "joint": model.njnt, "actuator": model.nu}
    for kind, count in counts.items():
        for i in range(count):
            if not getattr(model, kind)(i).name:
                raise ModelError(
                    f"{kind} {i} of '{path}' has no name; give each body, joint and actuator a name"
                )


def _unknown(asked: ArmArguments, axes: tuple[Axis, ...]) -> tuple[Uncertain, ...]:
    if asked.uncertain:
        return tuple(Uncertain(name, *bounds) for name, bounds in asked.uncertain.items())
    found = []
    for axis in axes:
        values: dict[str, Any] = {
            "damping": axis.joint.damping, "frictionloss": axis.joint.friction, "armature": axis.joint.armature
        }  # fmt: skip
        for quantity in OWN:
            value = values[quantity]
            if value > 0.0:
                name = f"{quantity}:{axis.joint.name}"
                found.append(Uncertain(name, value / SETTINGS.factor, value * SETTINGS.factor))
    if not found:
        raise ParameterError(
            f"nothing of '{asked.model}' is unknown: its driven joints have no damping, friction or armature; name ranges with "
            "uncertain={'damping:JOINT': (low, high)}"
        )
    return tuple(found)
