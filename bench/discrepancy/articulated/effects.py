"""The catalogue of articulated models: what may be missing at a joint, a body, a drive or an encoder.

An effect at a joint or a drive sets entries of the parameter vector of that joint's runs (`joint_run.Slot`); one of a body changes the
torque of the inverse dynamics of all joints; one of an encoder corrects the log. Parameters are of order one, as in the catalogue of
linear structures (`bench.discrepancy.effects.effect`), with the scales of the joint's own records.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.effects.effect import FreeParameter, log_grid
from bench.discrepancy.multibody.encoders import Encoder
from bench.discrepancy.multibody.joint_run import Slot
from bench.errors import UnknownNameError

Array = NDArray[np.float64]
Site = Literal["joint", "body", "actuator", "sensor"]
Values = dict[str, float]

NUMBERS = frozenset({
    "mass_error", "com_error", "armature_error", "damping_error", "force_gain_error", "servo_gain_error", "position_gain_error",
    "force_offset", "position_offset",
})  # fmt: skip
"""Effects that are a wrong number."""


@dataclass(frozen=True)
class EffectsSettings:
    """Numbers of `bench.discrepancy.articulated.effects`."""

    positive: Mapping[str, Any] = field(
        default_factory=lambda: {"mean": math.log(0.2), "std": 1.5, "bounds": (-9.0, 4.0)}
    )
    """Prior of a positive amplitude: a fifth of its scale, within a factor of twenty with 95 %."""
    signed: Mapping[str, Any] = field(
        default_factory=lambda: {"signed": True, "mean": 0.0, "std": 0.5, "bounds": (-30.0, 30.0)}
    )
    """Prior of an amplitude of either sign."""


SETTINGS = EffectsSettings()
TEETH = tuple(float(n) for n in range(2, 121))
"""Periods of cogging in a turn that are tried: slots, poles and teeth are whole numbers."""


class JointScales(NamedTuple):
    """Magnitudes of a joint's records that make parameters dimensionless.

    Attributes:
        force: RMS torque of the drive.
        peak: Largest force of the actuator.
        position: Largest excursion from the mean angle.
        velocity: Largest velocity.
        inertia: Mean inertia about the joint.
        input: RMS of the actuator's input, of a servo its position error.
        mass: Mass of the body.
        reach: Distance of the body's tip from its joint.
        middle: Mean angle.
    """

    force: float
    peak: float
    position: float
    velocity: float
    inertia: float
    input: float
    mass: float
    reach: float
    middle: float


@dataclass(frozen=True)
class ArticulatedEffect:
    """Something that may be missing from an articulated model.

    Attributes:
        name: Name in verdicts.
        family: Family.
        site: Where it sits.
        parameters: Free parameters, the amplitude first.
        equation: One line for reports.
        slots: For joints and actuators: values and the parameter vector (SLOTS,) to be changed in place.
        encoder: For sensors: values to what is wrong.
        servo: Only for servos (True), only for forces (False), or both (None).
        needs: Quantity that has to be measured ("velocity"), if any.
    """

    name: str
    family: str
    site: Site
    parameters: tuple[FreeParameter, ...]
    equation: str
    slots: Callable[[Values, Array], None] | None = None
    encoder: Callable[[Values], Encoder] | None = None
    servo: bool | None = None
    needs: str = ""

    @property
    def number(self) -> bool:
        """Whether a number of the model or of the log is wrong, rather than a force missing."""
        return self.name in NUMBERS

    @property
    def train(self) -> bool:
        """Whether it is an elastic drive train between motor and link."""
        return self.slots is _train

    def unit(self, parameter: FreeParameter, position: str) -> str:
        """Unit of a parameter on a joint whose coordinate has the unit `position`."""
        force, inertia = ("N m", "kg m^2") if position == "rad" else ("N", "kg")
        return parameter.unit or {
            "force": force, "peak": force, "input": force if self.servo is False else "input", "position": position,
            "velocity": f"{position}/s", "inertia": inertia, "mass": "kg", "reach": "m", "1": "1",
            "force/position": f"{force}/{position}", "force/velocity": f"{force} s/{position}",
            "force/velocity/velocity": f"{force} s^2/{position}^2",
        }[parameter.scale]  # fmt: skip

    def values(self, eta: Array, scales: JointScales) -> Values:
        """Physical values by name."""
        return {p.name: p.value(float(e), scales) for p, e in zip(self.parameters, eta, strict=True)}


def _set(**entries: str) -> Callable[[Values, Array], None]:
    """Setter of slots from values of the same names."""

    def change(values: Values, p: Array) -> None:
        for slot, name in entries.items():
            p[Slot[slot]] = values[name]

    return change


def _add(**entries: str) -> Callable[[Values, Array], None]:
    def change(values: Values, p: Array) -> None:
        for slot, name in entries.items():
            p[Slot[slot]] += values[name]

    return change


def _scale(*slots: Slot) -> Callable[[Values, Array], None]:
    def change(values: Values, p: Array) -> None:
        for slot in slots:
            p[slot] *= 1.0 + values["relative_error"]

    return change


def _saturated(values: Values, p: Array) -> None:
    p[Slot.LOW] = max(p[Slot.LOW], -values["limit"])
    p[Slot.HIGH] = min(p[Slot.HIGH], values["limit"])


def _train(values: Values, p: Array) -> None:
    p[Slot.TRAIN] = 1.0
    p[Slot.TRAIN_STIFFNESS] = values["stiffness"]
    p[Slot.TRAIN_DAMPING] = values["damping"]
    p[Slot.CLEARANCE] = values.get("half_clearance", 0.0)
    p[Slot.MOTOR] *= values["motor_share"]
    p[Slot.ENCODER] = values["encoder_on_link"]


def _stop(values: Values, p: Array) -> None:
    p[Slot.STOP] = values["stiffness"]
    p[Slot.STOP_AT] = values["position"]
    p[Slot.STOP_DAMPING] = values["damping"]
    p[Slot.STOP_SIDE] = values["side"]


def _cogging(values: Values, p: Array) -> None:
    sine, cosine = values["sine"], values["cosine"]
    p[Slot.COGGING] = math.hypot(sine, cosine)
    p[Slot.PERIODS] = values["periods_per_turn"]
    p[Slot.PHASE] = math.atan2(cosine, sine)


MOTOR_SHARE = FreeParameter(
    "motor_share", mean=0.0, std=0.5, bounds=(-4.0, -1e-3), grid=(-1e-2, math.log(0.4)), unit="1"
)
"""Part of the armature that sits on the motor's side of an elastic train; what is left of it moves with the link."""
ON_LINK = FreeParameter("encoder_on_link", fixed=True, signed=True, grid=(0.0, 1.0), unit="1")
"""Side of the encoder; tried where the channel does not state its ``"side"``."""
LIMIT = FreeParameter("limit", "force", **SETTINGS.positive)
IN_LOOP = FreeParameter("in_loop", fixed=True, signed=True, grid=(0.0, 1.0), unit="1")
RELATIVE = FreeParameter("relative_error", signed=True, mean=0.0, std=0.3, bounds=(-0.95, 20.0), unit="1")

CATALOGUE: tuple[ArticulatedEffect, ...] = (
    ArticulatedEffect(
        "coulomb_friction",
        "friction",
        "joint",
        (LIMIT,),
        "f = Fc sgn(v), set-valued at rest",
        _set(LIMIT="limit"),
    ),
    ArticulatedEffect(
        "stribeck_friction",
        "friction",
        "joint",
        (
            LIMIT,
            FreeParameter(
                "rise", mean=math.log(0.7), std=0.7, bounds=(-3.0, 2.5), grid=log_grid(0.7), unit="1"
            ),
            FreeParameter(
                "velocity",
                "velocity",
                mean=math.log(0.1),
                std=1.0,
                bounds=(-6.0, 0.7),
                grid=log_grid(0.03, 0.1, 0.3),
            ),
        ),
        "f = Fc (1 + rise exp(-(v/vs)^2)) sgn(v)",
        _set(LIMIT="limit", RISE="rise", STRIBECK="velocity"),
    ),
    ArticulatedEffect(
        "presliding_friction",
        "friction",
        "joint",
        (
            LIMIT,
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(3.0),
                std=1.5,
                bounds=(-4.0, 7.0),
                grid=log_grid(0.3, 1.0, 3.0, 10.0, 30.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.1),
                std=1.5,
                bounds=(-8.0, 3.0),
                grid=log_grid(0.03, 0.3),
            ),
        ),
        "f = s0 z + s1 z', z' = v - s0 |v| z / Fc (LuGre; Dahl for s1 = 0)",
        _set(BRISTLE_LIMIT="limit", BRISTLE_STIFFNESS="stiffness", BRISTLE_DAMPING="damping"),
    ),
    ArticulatedEffect(
        "load_dependent_friction",
        "friction",
        "joint",
        (
            FreeParameter(
                "limit_0", "force", mean=math.log(0.05), std=1.5, bounds=(-9.0, 4.0), grid=log_grid(0.05)
            ),
            FreeParameter(
                "mu", mean=math.log(0.1), std=1.0, bounds=(-7.0, 1.0), grid=log_grid(0.1), unit="1"
            ),
            FreeParameter("of_actuator", fixed=True, signed=True, grid=(0.0, 1.0), unit="1"),
        ),
        "f = (F0 + mu |torque carried|) sgn(v), that of the link, or of the actuator",
        _set(LIMIT="limit_0", CARRIED="mu", CARRIED_BY="of_actuator"),
    ),
    ArticulatedEffect(
        "force_offset",
        "offset",
        "joint",
        (FreeParameter("force", "force", **SETTINGS.signed),),
        "a constant torque on the joint",
        _add(OFFSET="force"),
    ),
    ArticulatedEffect(
        "damping_error",
        "damping",
        "joint",
        (FreeParameter("added", "force/velocity", signed=True, mean=0.0, std=0.3, bounds=(-30.0, 30.0)),),
        "f = dc v, beyond the stated uncertainty",
        _add(DAMPING="added"),
    ),
    ArticulatedEffect(
        "quadratic_damping",
        "damping",
        "joint",
        (FreeParameter("c2", "force/velocity/velocity", **SETTINGS.positive),),
        "f = c2 |v| v",
        _set(QUADRATIC="c2"),
    ),
    ArticulatedEffect(
        "joint_compliance",
        "drive",
        "joint",
        (
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(10.0),
                std=1.5,
                bounds=(-2.0, 9.0),
                grid=log_grid(1.0, 3.0, 10.0, 30.0, 100.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.1),
                std=1.5,
                bounds=(-9.0, 3.0),
                grid=log_grid(0.05),
            ),
            MOTOR_SHARE,
            ON_LINK,
        ),
        "T = k (q_motor - q_link) + c (v_motor - v_link)",
        _train,
    ),
    ArticulatedEffect(
        "backlash",
        "drive",
        "joint",
        (
            FreeParameter(
                "half_clearance",
                "position",
                mean=math.log(0.02),
                std=1.3,
                bounds=(-9.0, 0.0),
                grid=log_grid(0.003, 0.01, 0.03, 0.1),
            ),
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(300.0),
                std=1.5,
                bounds=(2.0, 11.0),
                grid=log_grid(300.0),
            ),
            FreeParameter(
                "damping",
                "force/velocity",
                mean=math.log(0.3),
                std=1.5,
                bounds=(-9.0, 5.0),
                grid=log_grid(0.3),
            ),
            MOTOR_SHARE,
            ON_LINK,
        ),
        "T = k dz(q_motor - q_link, b) + c (v_motor - v_link) in contact",
        _train,
    ),
    ArticulatedEffect(
        "cogging",
        "drive",
        "joint",
        (
            FreeParameter("sine", "force", signed=True, mean=0.0, std=0.3, bounds=(-10.0, 10.0)),
            FreeParameter("cosine", "force", signed=True, mean=0.0, std=0.3, bounds=(-10.0, 10.0)),
            FreeParameter(
                "periods_per_turn", fixed=True, signed=True, grid=TEETH, unit="1", bounds=(1.0, 400.0)
            ),
        ),
        "f = A sin(n q + phase)",
        _cogging,
    ),
    ArticulatedEffect(
        "one_sided_stop",
        "stop",
        "joint",
        (
            FreeParameter(
                "stiffness",
                "force/position",
                mean=math.log(3.0),
                std=1.5,
                bounds=(-4.0, 7.0),
                grid=log_grid(3.0),
            ),
            FreeParameter(
                "position",
                "position",
                signed=True,
                mean=0.0,
                std=0.7,
                bounds=(-1.2, 1.2),
                grid=(-0.8, -0.5, -0.2, 0.2, 0.5, 0.8),
            ),
            FreeParameter("damping", "force/velocity", mean=math.log(0.05), std=1.5, bounds=(-9.0, 3.0)),
            FreeParameter("side", fixed=True, signed=True, grid=(1.0, -1.0), unit="1"),
        ),
        "f = k d + c d', d = side (q - q0) > 0",
        _stop,
    ),
    ArticulatedEffect(
        "armature_error",
        "inertia",
        "joint",
        (FreeParameter("added", "inertia", signed=True, mean=0.0, std=1.0, bounds=(-1.0, 50.0)),),
        "tau = dJ q'', beyond the stated uncertainty",
        _add(INERTIA="added"),
    ),
    ArticulatedEffect(
        "actuator_delay",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "delay_s",
                "1",
                mean=math.log(0.01),
                std=1.0,
                bounds=(-9.0, -1.5),
                grid=log_grid(0.003, 0.01, 0.03),
                unit="s",
            ),
        ),
        "input acts later by a delay",
        _set(DELAY="delay_s"),
    ),
    ArticulatedEffect(
        "actuator_lag",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "time_constant_s",
                "1",
                mean=math.log(0.01),
                std=1.0,
                bounds=(-9.0, -1.0),
                grid=log_grid(0.003, 0.01, 0.03),
                unit="s",
            ),
        ),
        "T u' + u = input",
        _set(LAG="time_constant_s"),
    ),
    ArticulatedEffect(
        "force_gain_error", "actuator", "actuator", (RELATIVE,), "tau = (1 + e) nominal", _scale(Slot.GEAR)
    ),
    ArticulatedEffect(
        "servo_gain_error",
        "actuator",
        "actuator",
        (RELATIVE,),
        "kp = (1 + e) nominal",
        _scale(Slot.KP),
        servo=True,
    ),
    ArticulatedEffect(
        "actuator_saturation",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "limit", "peak", mean=math.log(0.5), std=0.7, bounds=(-4.0, 0.5), grid=log_grid(0.4, 0.6, 0.8)
            ),
        ),
        "|force| <= limit",
        _saturated,
    ),
    ArticulatedEffect(
        "actuator_deadband",
        "actuator",
        "actuator",
        (
            FreeParameter(
                "half_width",
                "input",
                mean=math.log(0.2),
                std=1.5,
                bounds=(-9.0, 2.0),
                grid=log_grid(0.03, 0.1, 0.3),
            ),
        ),
        "no force within a band of the input (of the position error of a servo)",
        _set(DEADBAND="half_width"),
    ),
    ArticulatedEffect(
        "position_offset",
        "sensor",
        "sensor",
        (FreeParameter("offset", "position", signed=True, mean=0.0, std=0.3, bounds=(-3.0, 3.0)), IN_LOOP),
        "logged = true + offset",
        encoder=lambda v: Encoder(offset=v["offset"], in_loop=v["in_loop"]),
    ),
    ArticulatedEffect(
        "position_gain_error",
        "sensor",
        "sensor",
        (
            FreeParameter("relative_error", signed=True, mean=0.0, std=0.1, bounds=(-0.7, 2.0), unit="1"),
            IN_LOOP,
        ),
        "logged = (1 + e) true",
        encoder=lambda v: Encoder(gain=v["relative_error"], in_loop=v["in_loop"]),
    ),
    ArticulatedEffect(
        "velocity_gain_error",
        "sensor",
        "sensor",
        (FreeParameter("relative_error", signed=True, mean=0.0, std=0.1, bounds=(-0.7, 2.0), unit="1"),),
        "logged velocity = (1 + e) true",
        encoder=lambda v: Encoder(speed=v["relative_error"]),
        needs="velocity",
    ),
    ArticulatedEffect(
        "position_delay",
        "sensor",
        "sensor",
        (
            FreeParameter(
                "delay_s",
                "1",
                mean=math.log(0.01),
                std=1.0,
                bounds=(-9.0, -1.5),
                grid=log_grid(0.01),
                unit="s",
            ),
        ),
        "logged later by a delay",
        encoder=lambda v: Encoder(delay=v["delay_s"]),
    ),
    ArticulatedEffect(
        "mass_error",
        "inertia",
        "body",
        (FreeParameter("payload", "mass", signed=True, mean=0.0, std=0.3, bounds=(-0.9, 10.0), unit="kg"),),
        "a mass at the tip of the body",
    ),
    ArticulatedEffect(
        "com_error",
        "inertia",
        "body",
        tuple(
            FreeParameter(
                f"shift_{axis}", "reach", signed=True, mean=0.0, std=0.1, bounds=(-3.0, 3.0), unit="m"
            )
            for axis in "xyz"
        ),
        "the centre of mass elsewhere in the body",
    ),
)


def effect(name: str) -> ArticulatedEffect:
    """Return an effect by name.

    Raises:
        UnknownNameError: There is none.
    """
    for entry in CATALOGUE:
        if entry.name == name:
            return entry
    raise UnknownNameError("effect of articulated models", name, [e.name for e in CATALOGUE])
