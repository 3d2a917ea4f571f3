"""Actuators of MuJoCo that drive a joint: what their input is, and the force that they make of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal

import mujoco
import numpy as np

from bench.arrays import Array
from bench.errors import ModelError

Commanded = Literal["position", "velocity", "voltage", "load", "another input"]

DRIVES = ("kp", "kv", "gear", "forcerange", "delay")
"""Parameters of actuators; ``forcerange`` is the largest force, of a dcmotor that of its full voltage at standstill."""


@dataclass(frozen=True)
class JointDrive:
    """The actuator of a joint.

    Attributes:
        name: Its name in the model.
        servo: Whether its input is a position target; otherwise a force, a velocity or a voltage.
        gear: Joint torque over actuator force; position and velocity of the actuator over those of the joint.
        kp: Position gain of a servo, or gain of the input.
        kv: Velocity gain.
        low: Lowest force of the actuator.
        high: Highest.
        lowest: Lowest input.
        highest: Highest.
        lag: Time constant of a first-order filter before it [s]; zero where there is none.
        delay: Delay of the input [s].
        back_emf: Force that the voltage induced by the motor takes, over the motor's speed.
        stall: Force of the full voltage at standstill; infinite where no voltage limits it.
    """

    name: str
    servo: bool
    gear: float
    kp: float
    kv: float
    low: float
    high: float
    lowest: float
    highest: float
    lag: float = 0.0
    delay: float = 0.0
    back_emf: float = 0.0
    stall: float = np.inf

    @property
    def motor(self) -> bool:
        """Whether it is a plain motor: a gain times its input at once, and nothing of its own motion."""
        return not self.servo and not any(
            (self.kv, self.lag, self.delay, self.back_emf, np.isfinite(self.stall))
        )

    @property
    def stiffness(self) -> float:
        """Stiffness that it gives the joint."""
        return self.gear**2 * self.kp if self.servo else 0.0

    @property
    def strongest(self) -> float:
        """Largest torque that it can give the joint, either way; infinite where nothing limits it."""
        return abs(self.gear) * min(max(abs(self.low), abs(self.high)), self.stall)

    @property
    def damping(self) -> float:
        """Damping that it gives the joint."""
        return self.gear**2 * self.kv

    def torque(self, command: Array, position: Array, velocity: Array) -> Array:
        """Torque (n,) on the joint at commands, positions and velocities of the joint (n,), filter and delay left out."""
        target = command - self.gear * position if self.servo else command
        force, taken = self.kp * target - self.kv * self.gear * velocity, self.back_emf * self.gear * velocity
        force = np.clip(force, -self.stall - taken, self.stall - taken)
        return self.gear * np.clip(force, self.low, self.high)

    def command(self, torque: Array, position: Array, velocity: Array) -> Array:
        """Command (n,) that makes a torque on the joint (n,), limits left out."""
        asked = (torque / (self.gear or 1.0) + self.kv * self.gear * velocity) / (self.kp or 1.0)
        return asked + self.gear * position if self.servo else asked


class DcMotor(IntEnum):
    """Where MuJoCo keeps the numbers of a DC motor, in ``gainprm``; the gains of its controller are in force, not in voltage."""

    RESISTANCE = 0
    CONSTANT = 1
    KP = 4
    KD = 6
    VOLTAGE = 7


def is_dc_motor(actuator: Any) -> bool:
    """Whether an actuator, of a compiled model or of a specification, is a ``dcmotor``."""
    return int(np.ravel(actuator.gaintype)[0]) == int(mujoco.mjtGain.mjGAIN_DCMOTOR)


def commanded(model: mujoco.MjModel, actuator: int) -> Commanded:
    """What the input of an actuator is: the target of a servo, the voltage of a motor, or the force itself, in some unit."""
    if is_dc_motor(model.actuator(actuator)):
        inputs: dict[int, Commanded] = {
            int(mujoco.mjtCtrlInput.mjINPUT_POS): "position",
            int(mujoco.mjtCtrlInput.mjINPUT_VEL): "velocity",
            int(mujoco.mjtCtrlInput.mjINPUT_VOLTAGE): "voltage",
        }
        return inputs.get(int(model.actuator_ctrlspec[actuator]), "another input")
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    if int(model.actuator_biastype[actuator]) != int(mujoco.mjtBias.mjBIAS_AFFINE):
        return "load"
    if bias[1] != 0.0:
        return "position"
    fixed = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    # of a velocity servo the input has the gain of the velocity; a motor may have a damping of its own besides
    return (
        "velocity" if fixed and bias[2] != 0.0 and abs(gain[0] + bias[2]) <= 1e-9 * abs(gain[0]) else "load"
    )


def is_driven(model: mujoco.MjModel, u: int, joint: int) -> bool:
    """Whether actuator `u` acts on a joint alone."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trntype[u]) in kinds and int(model.actuator_trnid[u, 0]) == joint


def drive_of(model: mujoco.MjModel, u: int) -> JointDrive:
    """Actuator `u`.

    Raises:
        ModelError: Its gain, bias or activation is none that the equation of a joint has.
    """
    name, gear = model.actuator(u).name, float(model.actuator_gear[u, 0])
    low, high = model.actuator_forcerange[u] if model.actuator_forcelimited[u] else (-np.inf, np.inf)
    lowest, highest = model.actuator_ctrlrange[u] if model.actuator_ctrllimited[u] else (-np.inf, np.inf)
    joint = int(model.actuator_trnid[u, 0])
    if model.jnt_actfrclimited[joint]:
        own = np.sort(np.array(model.jnt_actfrcrange[joint]) / gear)
        low, high = max(low, own[0]), min(high, own[1])
    electric = is_dc_motor(model.actuator(u))
    kp, kv, back_emf, stall = _motor(model, u) if electric else _affine(model, u)
    return JointDrive(
        name, commanded(model, u) == "position", gear, kp, kv, float(low), float(high), float(lowest), float(highest),
        0.0 if electric else _filter(model, u), float(model.actuator_delay[u]), back_emf, stall,
    )  # fmt: skip


def _affine(model: mujoco.MjModel, u: int) -> tuple[float, float, float, float]:
    """Gain of the input, velocity gain, back-EMF and stall force of a motor, a position or a velocity servo."""
    gain, bias = model.actuator_gainprm[u], model.actuator_biasprm[u]
    affine = int(model.actuator_biastype[u]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    fixed = int(model.actuator_gaintype[u]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    if not fixed or not (affine or int(model.actuator_biastype[u]) == int(mujoco.mjtBias.mjBIAS_NONE)):
        raise ModelError(
            f"actuator '{model.actuator(u).name}' has a gain or bias that is neither fixed nor affine; a motor, position, velocity or "
            "dcmotor actuator is expected"
        )
    return float(gain[0]), float(-bias[2]) if affine else 0.0, 0.0, np.inf


def _motor(model: mujoco.MjModel, u: int) -> tuple[float, float, float, float]:
    """The same of a DC motor: its controller asks for a torque and makes up for the back-EMF as far as the voltage goes."""
    name, gain = model.actuator(u).name, model.actuator_gainprm[u]
    asked = commanded(model, u)
    if model.actuator_actnum[u] or np.any(model.actuator_dynprm[u]) or np.any(model.actuator_biasprm[u]):
        raise ModelError(
            f"dcmotor '{name}' has a state or a law of its own besides its controller (inductance, integral gain, slew rate, temperature, "
            "cogging, LuGre friction); take it out and let the diagnosis look for what it does"
        )
    if asked not in ("position", "voltage"):
        raise ModelError(f"dcmotor '{name}' takes {asked}; input='pos' or input='voltage' is expected")
    resistance, constant, kp, kd, most = (float(gain[number]) for number in DcMotor)
    back_emf, stall = constant**2 / resistance, constant / resistance * most if most > 0.0 else np.inf
    if asked == "voltage":
        return constant / resistance, back_emf, back_emf, stall
    return kp, kd, back_emf, stall


def _filter(model: mujoco.MjModel, u: int) -> float:
    """Time constant of the activation of an actuator; zero where it has none."""
    kind = int(model.actuator_dyntype[u])
    if kind in (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT)):
        return float(model.actuator_dynprm[u, 0])
    if kind != int(mujoco.mjtDyn.mjDYN_NONE):
        raise ModelError(
            f"actuator '{model.actuator(u).name}' has an activation that is no first-order filter; none or 'filter' is expected"
        )
    return 0.0


def drive_value(model: mujoco.MjModel, u: int, kind: str) -> float:
    """Parameter of actuator `u`, one of `DRIVES`."""
    drive = drive_of(model, u)
    return {
        "kp": drive.kp, "kv": drive.kv, "gear": drive.gear, "forcerange": min(drive.high, drive.stall), "delay": drive.delay,
    }[kind]  # fmt: skip


def set_drive(model: mujoco.MjModel, u: int, kind: str, value: float) -> None:
    """Set a parameter of actuator `u`, one of `DRIVES`.

    Raises:
        ModelError: The actuator has none of that kind.
    """
    name, drive = model.actuator(u).name, drive_of(model, u)
    if kind == "forcerange" and not np.isfinite(min(drive.high, drive.stall)):
        raise ModelError(
            f"actuator '{name}' has no limit of its force that 'forcerange:{name}' could set; give it a forcerange, or take the "
            "parameter out"
        )
    if kind == "delay" and model.actuator_history[u, 0] < 1:
        raise ModelError(
            f"actuator '{name}' has no delay in the model that 'delay:{name}' could set; give it delay and nsample, or take the "
            "parameter out"
        )
    if kind in ("kp", "kv") and commanded(model, u) == "voltage":
        raise ModelError(
            f"dcmotor '{name}' takes a voltage and has neither kp nor kv; motorconst and resistance of its model are taken as they are"
        )
    if kind == "kp" and commanded(model, u) == "velocity":
        raise ModelError(f"actuator '{name}' follows a velocity, so that its gain is 'kv:{name}'; name it so")
    if kind == "delay":
        model.actuator_delay[u] = value
    else:
        write_drive(model.actuator(u), kind, value)


def write_drive(actuator: Any, kind: str, value: float) -> None:
    """Set a parameter of an actuator, one of `DRIVES` but its delay.

    Args:
        actuator: Of a compiled model, or of a specification.
        kind: Which.
        value: Its value.
    """
    gain, bias = actuator.gainprm, actuator.biasprm
    if kind == "gear":
        actuator.gear[0] = value
    elif kind == "forcerange" and is_dc_motor(actuator) and gain[DcMotor.VOLTAGE] > 0.0:
        gain[DcMotor.VOLTAGE] = value * gain[DcMotor.RESISTANCE] / gain[DcMotor.CONSTANT]
    elif kind == "forcerange":
        actuator.forcerange[:] = np.array(actuator.forcerange) * (value / actuator.forcerange[1])
    elif is_dc_motor(actuator):
        gain[DcMotor.KP if kind == "kp" else DcMotor.KD] = value
    elif kind == "kp":
        if bias[1] != 0.0:  # a servo's input and its position have one gain
            bias[1] = -value
        gain[0] = value
    else:
        if bias[1] == 0.0 and bias[2] == -gain[0]:  # and so have those of a velocity servo
            gain[0] = value
        bias[2] = -value
