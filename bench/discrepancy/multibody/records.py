"""Records of an articulated model, prepared: for every joint the coefficients of its equation along the measured motion, and its noise.

The motion is smoothed from the encoders (`kalman_smoother`). Where an encoder is wrong, its log is corrected first (`Encoder`), and all
follows from the corrected one, since a posture that is wrong at one joint is felt by all.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.multibody.body_numbers import BodyNumbers
from bench.discrepancy.multibody.body_terms import body_terms, gravity_terms
from bench.discrepancy.multibody.encoders import TRUE, Encoder, encoders_of, weights_of
from bench.discrepancy.multibody.inputs import input_of, load_on, noise_of_loads
from bench.discrepancy.multibody.joint_record import JointRecord
from bench.discrepancy.multibody.model import ArticulatedModel, Dynamics
from bench.discrepancy.multibody.motion import Coefficients, JointClock, JointMotion, clock_of, motion_of
from bench.discrepancy.multibody.noise import torque_noise
from bench.discrepancy.multibody.touch import touches_along
from bench.discrepancy.numerics.uniform_spline import uniform_spline
from bench.discrepancy.settings import DEFAULT, ArticulatedSettings, DiagnosisSettings


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """A record, prepared for all joints.

    Attributes:
        record: The record.
        motion: Its smoothed motion.
        joints: (n_joints,) what every joint's equation needs.
    """

    record: CaseRecord
    motion: JointMotion
    joints: tuple[JointRecord, ...]

    def read_by(self, encoders: Mapping[str, Encoder]) -> PreparedRecord:
        """The record with encoders that differ in what reads them alone."""
        joints = []
        for joint in self.joints:
            new = copy.copy(joint)
            object.__setattr__(new, "encoder", encoders.get(joint.joint.name, joint.encoder))
            joints.append(new)
        return replace(self, joints=tuple(joints))


def prepare(
    case: Case, model: ArticulatedModel, record: CaseRecord, *, settings: DiagnosisSettings = DEFAULT
) -> PreparedRecord:
    """Prepare a record for all joints of a model at its nominal parameters."""
    motion = motion_of(case, model, record, {}, settings=settings.motion)
    moved = (motion.position, motion.velocity, motion.acceleration)
    clock = clock_of(record, settings=settings.articulated)
    dynamics = model.dynamics(*moved)
    base = Coefficients.of(dynamics, motion, clock, _pushed(case, model, record, clock))
    beside = _changes(motion, clock, dynamics)
    bodies = body_terms(case, model, moved, beside)
    payloads = {body: beside(model.with_payload(body, 1.0).dynamics(*moved)) for body in model.bodies}
    centres = {
        body: np.stack(
            [
                beside(model.with_centre(body, settings.articulated.shift * axis).dynamics(*moved))
                / settings.articulated.shift
                for axis in np.eye(3)
            ]
        )
        for body in model.bodies
    }
    weights = {body: clock.between(model.weight(body, motion.position)) for body in model.bodies}
    gravity = gravity_terms(model, moved, beside)
    slope, speeds = clock.between(model.slopes(*moved)), clock.between(motion.velocity)
    process = torque_noise(model, motion, clock, record.step)
    touches = touches_along(model, motion, clock)
    joints = []
    for j, joint in enumerate(model.joints):
        drive, channel = joint.drive, input_of(case, joint)
        assert drive is not None
        stated = 0.0 if drive.servo else (channel.noise_std or 0.0) * abs(drive.gear * drive.kp)
        stated = float(np.hypot(stated, noise_of_loads(case, joint)))
        raw = JointRecord(
            joint, record.step / clock.n_sub, clock.n_sub, base.inertia[j] + joint.armature, base.bias[j], slope[j],
            base.reference[j], base.acceleration[j], _between(case, record.values[channel.name], clock), *_measured(motion, j),
            encoders_of(case, joint).channels[0].side, float(np.hypot(stated, process[j])),
            {b: terms.of_joint(j) for b, terms in bodies.items()}, {b: c[j] for b, c in payloads.items()},
            {b: np.ascontiguousarray(c[:, j]) for b, c in centres.items()}, {b: c[j] for b, c in weights.items()},
            gravity.of_joint(j), beside_of(model, j, speeds), touches[j], record.step, np.ones((len(record), len(motion.noise[j]))),
        )  # fmt: skip
        joints.append(replace(raw, weight=weights_of(case, record, joint, raw.innovation)))
    return PreparedRecord(record, motion, tuple(joints))


def corrected(
    case: Case,
    model: ArticulatedModel,
    prepared: PreparedRecord,
    encoders: Mapping[str, Encoder],
    *,
    settings: DiagnosisSettings = DEFAULT,
) -> PreparedRecord:
    """A prepared record, the logs of its encoders corrected; derivatives by masses and postures are kept as they were."""
    motion = motion_of(case, model, prepared.record, encoders, prepared.motion, settings=settings.motion)
    clock = clock_of(prepared.record, settings=settings.articulated)
    dynamics = model.dynamics(motion.position, motion.velocity, motion.acceleration)
    pushed, speeds = _pushed(case, model, prepared.record, clock), clock.between(motion.velocity)
    now = Coefficients.of(dynamics, motion, clock, pushed)
    joints = []
    for j, old in enumerate(prepared.joints):
        position, velocity, noise, start, _ = _measured(motion, j)
        new, command = now, old.command
        wrong = encoders.get(old.joint.name, TRUE)
        if wrong.delay:  # what acts on the joint is late by as much, on the clock of its log
            late = clock.later(wrong.delay)
            new = Coefficients.of(dynamics, motion, late, _pushed(case, model, prepared.record, late))
            command = _between(case, prepared.record.values[input_of(case, old.joint).name], late)
        joints.append(
            replace(
                old, inertia=new.inertia[j] + old.joint.armature, bias=new.bias[j], reference=new.reference[j],
                acceleration=new.acceleration[j], command=command, position=position, velocity=velocity, noise=noise, start=start,
                encoder=wrong, beside=beside_of(model, j, speeds),
            )
        )  # fmt: skip
    return PreparedRecord(prepared.record, motion, tuple(joints))


def settled(
    case: Case,
    model: ArticulatedModel,
    raw: PreparedRecord,
    prepared: PreparedRecord,
    links: Mapping[int, Array],
    numbers: BodyNumbers,
    *,
    settings: ArticulatedSettings = DEFAULT.articulated,
) -> PreparedRecord:
    """A record about the postures that a fit has.

    Args:
        case: The case.
        model: Its model.
        raw: The record as prepared for the nominal model.
        prepared: The same with its encoders corrected, see `corrected`; `raw` itself where they are right.
        links: Of elastic joints with the encoder at the motor: joint to position and velocity (n, 2) of its link.
        numbers: Bodies as the fit has them.
        settings: `ArticulatedSettings` of the diagnosis.
    """
    if prepared is not raw:
        raw = _reposed(case, model, raw, prepared.motion, settings)
    if not links:
        return raw
    step, motion = raw.record.step, raw.motion
    out = [np.array(part) for part in motion[:3]]
    sections = butter(2, min(2.0 * settings.followed * step, 0.9), output="sos")
    for j, states in links.items():
        away = sosfiltfilt(sections, states - np.column_stack([out[0][:, j], out[1][:, j]]), axis=0)
        out[0][:, j] += away[:, 0]
        out[1][:, j] += away[:, 1]
        out[2][:, j] += np.gradient(away[:, 1], step)
    clock = clock_of(raw.record, settings=settings)
    linked = motion._replace(position=out[0], velocity=out[1], acceleration=out[2])
    pushed = _pushed(case, model, raw.record, clock)
    now = Coefficients.of(numbers.put_into(model).dynamics(*out), linked, clock, pushed)
    joints = []
    for j, old in enumerate(raw.joints):
        # derivatives by the numbers of bodies stay those where the motors are; with the numbers as given, the equations are exact
        bias, inertia = old.coefficients(numbers.of_inertia())
        joints.append(
            replace(
                old, inertia=now.inertia[j] + old.joint.armature + old.inertia - inertia, bias=now.bias[j] + old.bias - bias,
                reference=now.reference[j], acceleration=now.acceleration[j],
            )
        )  # fmt: skip
    return replace(raw, joints=tuple(joints))


def _reposed(
    case: Case,
    model: ArticulatedModel,
    raw: PreparedRecord,
    motion: JointMotion,
    settings: ArticulatedSettings,
) -> PreparedRecord:
    """A record whose derivatives by the numbers of bodies are those along another motion, that of its corrected encoders."""
    moved = (motion.position, motion.velocity, motion.acceleration)
    clock = clock_of(raw.record, settings=settings)
    bodies = body_terms(case, model, moved, _changes(motion, clock, model.dynamics(*moved)))
    own = [{body: terms.of_joint(j) for body, terms in bodies.items()} for j in range(len(raw.joints))]
    return replace(raw, joints=tuple(replace(old, bodies=b) for old, b in zip(raw.joints, own, strict=True)))


def beside_of(model: ArticulatedModel, j: int, speeds: Array) -> dict[str, Array]:
    """Velocities (n_steps,) of the neighbours of joint `j`, from those of all (n_joints, n_steps)."""
    names = model.neighbours(j)
    return {name: speeds[i] for i, joint in enumerate(model.joints) if (name := joint.name) in names}


def _measured(motion: JointMotion, j: int) -> tuple[Array, Array, Array, Array, Array]:
    """Measured positions, velocities, their noise, the start of joint `j` and its covariance."""
    samples = motion.samples[j]
    velocity = np.ascontiguousarray(samples[:, 1]) if samples.shape[1] > 1 else np.zeros(0)
    start = np.array([motion.position[0, j], motion.velocity[0, j]])
    smoother = motion.smoothers[j]
    spread = np.zeros((2, 2)) if smoother is None else smoother.one_sided[:2, :2]
    return np.ascontiguousarray(samples[:, 0]), velocity, motion.noise[j], start, spread


def _changes(motion: JointMotion, clock: JointClock, base: Dynamics) -> Callable[[Dynamics], Array]:
    """Takes inverse dynamics along a motion to what they change (n_joints, 2, n_steps) in bias and inertia."""
    return lambda changed: Coefficients.of(_difference(changed, base), motion, clock).stacked


def _difference(changed: Dynamics, base: Dynamics) -> Dynamics:
    return Dynamics(changed.torque - base.torque, changed.inertia - base.inertia)


def _pushed(case: Case, model: ArticulatedModel, record: CaseRecord, clock: JointClock) -> Array:
    """Torque (n_joints, n_steps) of the loads on the joints besides their drives, zero on those that are followed."""
    out = np.zeros((len(model.moving), len(clock.middles)))
    for j, joint in enumerate(model.joints):
        if joint.loads:
            out[j] = _between(case, load_on(case, joint, record), clock)
    return out


def _between(case: Case, samples: Array, clock: JointClock) -> Array:
    """An input at the middle of every step."""
    if case.load_interpolation == "zero_order_hold":
        return samples[np.searchsorted(clock.samples, clock.middles, side="right") - 1]
    if case.load_interpolation == "band_limited":
        return uniform_spline(samples, clock.step, clock.middles)
    return np.interp(clock.middles, clock.samples, samples)
