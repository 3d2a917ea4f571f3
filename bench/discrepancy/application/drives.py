"""Effects of actuators in MuJoCo's own terms, and of sensors, which are wrong in the log and not in the model."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from bench.discrepancy.application.forces import values_of
from bench.discrepancy.application.target import Change, Target
from bench.discrepancy.effects.sensor_actuator import ANALOGUE_LAG
from bench.discrepancy.verdict import NamedEffect
from bench.rig.actuators import DcMotor, commanded, is_dc_motor, write_drive


def _actuator(target: Target, effect: NamedEffect) -> Any:
    return target.actuator(
        effect.where if effect.where and effect.where in _actuators(target) else effect.channel
    )


def _actuators(target: Target) -> list[str]:
    return [actuator.name for actuator in target.spec.actuators]


def _done(effect: NamedEffect, actuator: Any, text: str, **more: Any) -> Change:
    return Change(effect.name, actuator.name, "native", text, (("actuator", actuator.name),), **more)


def delay(target: Target, effect: NamedEffect) -> Change:
    """MuJoCo's delay of the control, along straight lines between steps."""
    actuator = _actuator(target, effect)
    late = next(iter(values_of(effect).values()))
    before = float(actuator.delay)
    set_delay(target, actuator, before + late)
    return _done(effect, actuator, f"delay {before:.6g} -> {actuator.delay:.6g} s")


def lag(target: Target, effect: NamedEffect) -> Change:
    """MuJoCo's first-order filter of the control. What it filters of a servo is the target, not the force.

    A step is run with the activation that it begins with, half a step late, or with the one that it ends with (`actearly`), half a step
    ahead; a drive that moves on once a sample is half a sample ahead of a filter. What is left of these is taken off the time constant,
    which is the delay of what is slow.
    """
    actuator = _actuator(target, effect)
    constant = next(iter(values_of(effect).values()))
    linear = "time_constant" in effect.parameters
    digital = linear and effect.variant != ANALOGUE_LAG.variant
    ahead = 0.5 * (target.sampling - target.step if digital else target.step) if linear else 0.0
    if actuator.dyntype not in (
        mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT
    ):  # fmt: skip
        return Change(
            effect.name, actuator.name, "none", "the actuator has an activation of another kind already"
        )
    before = 0.0 if actuator.dyntype == mujoco.mjtDyn.mjDYN_NONE else float(actuator.dynprm[0])
    actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
    actuator.dynprm[0] = before + max(constant - ahead, 0.0)
    actuator.actdim = 1
    actuator.actearly = digital or not linear
    other = _servo(target, actuator) and effect.name == "actuator_lag"
    text = f"a first-order filter of {actuator.dynprm[0]:.6g} s"
    if other:
        text += " (of the servo's target; the diagnosis lags its force)"
    elif digital:
        text += f" (an analogue one; that of the diagnosis, of {constant:.6g} s, moves on once a sample, half a sample earlier)"
    return _done(effect, actuator, text)


def gain(target: Target, effect: NamedEffect) -> Change:
    """The force of an actuator, all of it, times a factor; of a reversed one minus one."""
    actuator = _actuator(target, effect)
    v = values_of(effect)
    factor = 1.0 + v["relative_error"] if "relative_error" in v else -v.get("reversal", 1.0)
    if is_dc_motor(actuator):
        if factor <= 0.0:
            return Change(
                effect.name, actuator.name, "none", "a dcmotor turns the other way by its gear alone"
            )
        before = float(actuator.gainprm[DcMotor.RESISTANCE])
        actuator.gainprm[DcMotor.RESISTANCE] /= factor
        for asked in (DcMotor.KP, DcMotor.KD):
            actuator.gainprm[asked] *= factor
        text = f"resistance {before:.6g} -> {before / factor:.6g}, kp and kd times {factor:.6g}"
    else:
        before = float(actuator.gainprm[0])
        _freeze_damping(target, actuator)
        actuator.gainprm[0] *= factor
        actuator.biasprm[:3] = np.asarray(actuator.biasprm[:3]) * factor
        text = f"gain {before:.6g} -> {actuator.gainprm[0]:.6g}, and all of its force with it"
    if "relative_error" in v and _limited(target, actuator):
        actuator.forcerange = np.sort(np.asarray(actuator.forcerange) * factor)
    return _done(effect, actuator, text)


def _servo(target: Target, actuator: Any) -> bool:
    """Whether the control is a position target."""
    return commanded(target.nominal, target.nominal.actuator(actuator.name).id) == "position"


def _freeze_damping(target: Target, actuator: Any) -> None:
    """Write out the velocity gain of a servo that gives a damping ratio, so that it stays what it was."""
    if actuator.biasprm[2] > 0.0:
        i = target.nominal.actuator(actuator.name).id
        actuator.biasprm[2] = float(target.nominal.actuator_biasprm[i, 2])


def _limited(target: Target, actuator: Any) -> bool:
    return bool(target.nominal.actuator_forcelimited[target.nominal.actuator(actuator.name).id])


def servo_gain(target: Target, effect: NamedEffect) -> Change:
    """The position gain of a servo."""
    actuator = _actuator(target, effect)
    at = DcMotor.KP if is_dc_motor(actuator) else 0
    return _done(
        effect,
        actuator,
        set_kp(target, actuator, float(actuator.gainprm[at]) * (1.0 + values_of(effect)["relative_error"])),
    )


def set_kp(target: Target, actuator: Any, kp: float) -> str:
    """Set the position gain of a servo, or the gain of another actuator; return what was done."""
    before = float(actuator.gainprm[DcMotor.KP if is_dc_motor(actuator) else 0])
    _freeze_damping(target, actuator)
    write_drive(actuator, "kp", kp)
    return f"kp {before:.6g} -> {kp:.6g}"


def set_delay(target: Target, actuator: Any, delay: float) -> None:
    """Set the delay of a control, and the memory that it takes."""
    actuator.delay = max(delay, 0.0)
    actuator.nsample = math.ceil(actuator.delay / target.step) + 2
    actuator.interp = 1


def saturation(target: Target, effect: NamedEffect) -> Change:
    """The largest force of an actuator."""
    actuator = _actuator(target, effect)
    level = abs(next(iter(values_of(effect).values())))
    level *= abs(float(actuator.gainprm[0])) if "level" in effect.parameters else 1.0
    low, high = (-level, level)
    if _limited(target, actuator):
        low, high = max(low, float(actuator.forcerange[0])), min(high, float(actuator.forcerange[1]))
    actuator.forcerange = (low, high)
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    return _done(effect, actuator, f"forcerange {low:.6g} {high:.6g}")


def deadband(target: Target, effect: NamedEffect) -> Change:
    """No force within a band: the control is moved by as much before every step."""
    actuator = _actuator(target, effect)
    width = values_of(effect)["half_width"]
    read = "data.actuator_length[u]" if _servo(target, actuator) else "0.0"
    lines = (
        f"u = model.actuator({actuator.name!r}).id; error = data.ctrl[u] - {read}",
        f"data.ctrl[u] = {read} + math.copysign(max(abs(error) - {width:.8g}, 0.0), error)",
    )
    text = f"a dead band of {width:.6g} to either side, by before_step in the snippet"
    return Change(effect.name, actuator.name, "step", text, (("actuator", actuator.name),), lines=lines)


def logged(target: Target, effect: NamedEffect) -> Change:
    """A sensor or a clock that is wrong: the log is corrected, the model is not; a servo that acts on the wrong reading keeps it."""
    v, name = values_of(effect), effect.where or effect.channel
    numbers = ", ".join(f"{key} {value:.6g}" for key, value in v.items() if key != "in_loop")
    channel = effect.channel or effect.where
    text = f"changes the log, not the model: {effect.equation} on '{channel}', with {numbers}"
    if v.get("in_loop", 0.0) < 0.5:
        return Change(effect.name, name, "log", text)
    servo = next((a for a in target.spec.actuators if a.target == name and _servo(target, a)), None)
    if servo is None:
        return Change(effect.name, name, "log", text)
    wrong = float(servo.gear[0]) * v.get("offset", 0.0)
    if is_dc_motor(servo):
        off = f"{wrong:.8g}" if "offset" in v else f"{v['relative_error']:.8g} * data.actuator_length[u]"
        servo.gainprm[DcMotor.KD] *= 1.0 + v.get("relative_error", 0.0)
        lines = (f"u = model.actuator({servo.name!r}).id; data.ctrl[u] -= {off}",)
        text += "; the servo acts on that reading, by before_step in the snippet"
        return Change(effect.name, name, "log", text, (("actuator", servo.name),), lines=lines)
    _freeze_damping(target, servo)
    if "offset" in v:
        servo.biasprm[0] += float(servo.biasprm[1]) * wrong
    else:
        servo.biasprm[1:3] = np.asarray(servo.biasprm[1:3]) * (1.0 + v["relative_error"])
    text += "; the servo acts on that reading, which its biasprm now says"
    return Change(effect.name, name, "log", text, (("actuator", servo.name),))


DRIVES: dict[str, Callable[[Target, NamedEffect], Change]] = {
    "actuator_delay": delay,
    "actuator_lag": lag,
    "target_lag": lag,
    "force_gain_error": gain,
    "force_polarity": gain,
    "servo_gain_error": servo_gain,
    "actuator_saturation": saturation,
    "actuator_deadband": deadband,
}
"""Effects of actuators."""
LOGGED = ("displacement_", "acceleration_", "position_", "velocity_", "force_delay", "clock_")
"""Beginnings of the names of effects of what was logged."""
