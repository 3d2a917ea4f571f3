"""What has to hold before an articulated model is fitted: units by the model, its values in place, nothing of it left out where it acts,
and no factor and no sign that is one of the recording.

Joint by joint, the input that the nominal model asks for along the measured motion is held against the one recorded. Wrong or missing
forces change their ratio from band to band; a unit changes it by one factor in all bands, a turned encoder or motor turns it in all.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.unit_conversion import converted
from bench.discrepancy.checks.bands import bands_between, common_factor, compare_channels, spectra
from bench.discrepancy.checks.like_mujoco import ITEMS
from bench.discrepancy.checks.load_limits import clipped_case
from bench.discrepancy.checks.nominal_values import value_notes
from bench.discrepancy.checks.scales import grossly_apart, model_words, pair_words, shown_noise, suggestion
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.model.mjcf_units import expected_units
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.model import ArticulatedModel, Joint, with_nominal_values
from bench.discrepancy.multibody.records import Motion, encoders_of, input_of, motion_of
from bench.discrepancy.settings import (
    DEFAULT,
    ChecksSettings,
    DiagnosisSettings,
    LikenessSettings,
    ScaleSettings,
)
from bench.errors import ModelError, RecordingError, UnitError

Array = NDArray[np.float64]
Moving = tuple[CaseRecord, Motion]
"""A record and its motion."""


@dataclass(frozen=True)
class ComparisonSettings:
    """How the equations of the joints are held against MuJoCo's.

    Attributes:
        poses: Samples of a record at which they are.
        like: When a difference counts; `LikenessSettings.share` of the torque, here of what acts on the joint.
    """

    poses: int = 200
    like: LikenessSettings = field(default_factory=LikenessSettings)


class AdmittedRobot(NamedTuple):
    """An articulated case that may be diagnosed.

    Attributes:
        case: In the units of its model, its channels bound to joints and actuators.
        compiled: The user's model with the values of nominal.json.
        notes: What was done to it or is doubtful about it, a sentence each.
    """

    case: Case
    compiled: mujoco.MjModel
    notes: tuple[str, ...]


def admitted_robot(
    declared: Case, *, anyway: bool = False, settings: DiagnosisSettings = DEFAULT
) -> AdmittedRobot:
    """Admit a case of an articulated model to the diagnosis.

    Args:
        declared: The case as read.
        anyway: Whether what is doubtful is noted rather than refused.
        settings: Thresholds of the diagnosis.

    Raises:
        UnitError: A unit does not fit, or a channel is off by a factor or a sign.
        ModelError: The model holds what the equations of its joints do not, and it comes into play.
        RecordingError: Nothing moves the model, or nothing is measured.
        FileFormatError: A joint is not measured or not driven.
        UnknownNameError: A channel or parameter names nothing in the model.
    """
    rig = rig_of(declared)
    case, said = converted(declared, *expected_units(declared, rig))
    compiled = with_nominal_values(rig, case.parameters)
    case = bound(case, compiled)
    model = ArticulatedModel.of(compiled, case.rig)
    _refuse(case, model)
    case, clipped = _within_ranges(case, model)
    records = (*case.identification, *case.validation)
    moving = [(record, motion_of(case, model, record, {}, settings=settings.motion)) for record in records]
    doubts = _suspicions(declared, case, model, moving[: len(case.identification)], settings.checks)
    for first in doubts:
        if not anyway:
            more = f" (and {len(doubts) - 1} more such)" if len(doubts) > 1 else ""
            raise UnitError(f"{first}{more}; --anyway diagnoses the records as they are")
    apart = _left_out(case, model, compiled, moving, ComparisonSettings(like=settings.checks.likeness))
    if apart and not anyway:
        raise ModelError(f"{apart}; --anyway diagnoses with the nominal model all the same")
    doubts = (*doubts, apart) if apart else doubts
    return AdmittedRobot(
        case, compiled, (*said, *clipped, *value_notes(case, rig, settings=settings.model), *doubts)
    )


def _refuse(case: Case, model: ArticulatedModel) -> None:
    """Refuse records that no diagnosis can use."""
    inputs = [input_of(case, joint).name for joint in model.joints]
    responses = [c.name for joint in model.joints for c in encoders_of(case, joint).channels]
    for record in case.identification:
        for i, first in enumerate(responses):
            for second in (*inputs, *responses[:i]):
                if np.ptp(record.values[first]) > 0.0 and np.array_equal(
                    record.values[first], record.values[second]
                ):
                    raise RecordingError(
                        f"'{second}' and '{first}' are the same numbers in '{record.name}'; "
                        "one column was copied: correct the file, or take one channel out of nominal.json"
                    )
    for names, what in ((inputs, "so nothing drives the model"), (responses, "so nothing moved")):
        if all(np.ptp(record.values[name]) == 0.0 for record in case.identification for name in names):
            listed = " and ".join(f"'{name}'" for name in names)
            raise RecordingError(
                f"{listed} never {'changes' if len(names) == 1 else 'change'} in the identification records, {what}; "
                "look whether the columns are the right ones"
            )


def _within_ranges(case: Case, model: ArticulatedModel) -> tuple[Case, tuple[str, ...]]:
    """The case with commands clipped to the ``ctrlrange`` of their actuators, as MuJoCo clips them, and where that made a difference."""
    ranges = {}
    for joint in model.joints:
        channel = input_of(case, joint)
        if joint.drive is not None and channel.role != "measured":
            low, high = joint.drive.lowest, joint.drive.highest
            ranges[channel.name] = (low, high, f"ctrlrange of actuator '{joint.drive.name}'")
    return clipped_case(case, ranges)


def _suspicions(
    declared: Case, case: Case, model: ArticulatedModel, moving: list[Moving], checks: ChecksSettings
) -> tuple[str, ...]:
    """Factors and signs of the recording, a sentence each; what is found first makes nonsense of the comparisons after it."""
    # the input asked for is an inverse: no resonance turns its sign, only inertia and stiffness near the frequency at which they cancel
    settings = replace(checks.scales, octaves=min(checks.scales.octaves, 1.0))
    for found in (
        _between(declared, case, model, settings, checks),
        _beyond_ranges(declared, case, model, settings),
        _against_model(declared, case, model, moving, settings),
    ):
        said = tuple(dict.fromkeys(found))
        if said:
            return said
    return ()


def _between(
    declared: Case, case: Case, model: ArticulatedModel, settings: ScaleSettings, checks: ChecksSettings
) -> Iterator[str]:
    """Position and velocity of one joint that are no derivatives of one another."""
    for joint in model.joints:
        channels = encoders_of(case, joint).channels
        if len(channels) < 2:
            continue
        first, second = (channel.name for channel in channels)
        for record in case.identification:
            pair = compare_channels(
                record.values[first], record.values[second], orders=(0, 1), step=record.step, settings=settings,
                noise=(shown_noise(case, first, record), shown_noise(case, second, record)),
            )  # fmt: skip
            if pair is not None and grossly_apart(pair, settings):
                yield pair_words(declared, second, first, pair, 1, record, settings=checks)


def _beyond_ranges(
    declared: Case, case: Case, model: ArticulatedModel, settings: ScaleSettings
) -> Iterator[str]:
    """Joints that travel far more than their stops let them."""
    for joint in model.joints:
        name, width = encoders_of(case, joint).channels[0].name, joint.range[1] - joint.range[0]
        for record in case.identification:
            travelled = float(np.ptp(record.values[name]))
            if travelled > settings.gross * width:
                # whatever factor brings it between its stops may be the unit's: the nearest one known is asked for
                hint = suggestion(declared, name, travelled / width, travelled / width)
                yield (
                    f"'{name}' travels {travelled:.4g} {joint.unit} in '{record.name}', and the stops of joint '{joint.name}' are "
                    f"{width:.4g} {joint.unit} apart: {hint or 'correct its unit, or the range in the model'}"
                )


def _against_model(
    declared: Case, case: Case, model: ArticulatedModel, moving: list[Moving], settings: ScaleSettings
) -> Iterator[str]:
    """Joints whose recorded input is the one that the nominal model asks for but for a factor or a sign.

    An encoder in a wrong unit makes nonsense of the torques on its neighbours, too: what a unit explains comes first.
    """
    said = []
    for j, joint in enumerate(model.joints):
        channel, position = input_of(case, joint).name, encoders_of(case, joint).channels[0].name
        found = []
        for record, motion in moving:
            noise = (shown_noise(case, channel, record), 0.0)
            asked = _asked(model, joint, j, motion)
            bands = bands_between(spectra(record.values[channel], asked, record.step, noise, settings))
            if bands is not None:
                found.append(common_factor(bands, settings))
        if found and all(one != (1.0, 1.0) for one in found):
            factor = float(np.exp(np.mean([np.log(one) for one, _ in found])))
            sign = -1.0 if all(turned < 0.0 for _, turned in found) else 1.0
            explained = any(
                suggestion(declared, name, times)
                for name, times in ((position, factor), (channel, 1.0 / factor))
            )
            said.append((not explained, model_words(declared, (position,), (channel,), factor, sign)))
    yield from (words for _, words in sorted(said, key=lambda entry: entry[0]))


def _asked(model: ArticulatedModel, joint: Joint, j: int, motion: Motion) -> Array:
    """The input (n,) of a joint's drive along a motion, by its nominal equation without dry friction."""
    drive = joint.drive
    assert drive is not None
    force = _needed(model, joint, j, motion) / (drive.gear or 1.0)
    if drive.servo:
        return motion.position[:, j] + (force + drive.kv * motion.velocity[:, j]) / drive.kp
    return force / (drive.kp or 1.0)


def _needed(model: ArticulatedModel, joint: Joint, j: int, motion: Motion) -> Array:
    """Torque (n,) that the nominal equation of a joint asks of its drive, without dry friction."""
    q, v, a = motion.position, motion.velocity, motion.acceleration
    bodies = model.dynamics(q, v, a).torque[:, j]
    return (
        bodies
        + joint.armature * a[:, j]
        + joint.damping * v[:, j]
        + joint.stiffness * (q[:, j] - joint.reference)
    )


class _Apart(NamedTuple):
    share: float
    joint: str
    time: float
    moving: int
    index: int


def _left_out(
    case: Case,
    model: ArticulatedModel,
    compiled: mujoco.MjModel,
    moving: list[Moving],
    settings: ComparisonSettings,
) -> str:
    """What MuJoCo has act on a joint along the measured motion and the joint's equation has not, in words; empty where nothing is.

    Dry friction is left out of both: at rest it is whatever holds the joint.
    """
    plain = copy.copy(compiled)
    plain.dof_frictionloss[:] = 0.0
    worst: _Apart | None = None
    for r, (record, motion) in enumerate(moving):
        picked = np.unique(np.linspace(0, len(record) - 1, settings.poses).astype(int))
        ours = _balance(case, model, record, motion)[picked]
        theirs, size = _balance_of_mujoco(case, plain, model, record, motion, picked)
        apart = np.abs(theirs - ours)
        for j, joint in enumerate(model.joints):
            share = float(np.sqrt(np.mean(apart[:, j] ** 2)) / max(float(size[j]), 1e-300))
            if share > settings.like.share and (worst is None or share > worst.share):
                first = int(picked[int(np.argmax(apart[:, j] > settings.like.share * size[j]))])
                worst = _Apart(share, joint.name, float(record.time[first]), r, j)
    if worst is None:
        return ""
    record, motion = moving[worst.moving]
    culprit = _culprit(case, model, plain, record, motion, worst.index, settings)
    return (
        f"along the motion of '{record.name}' MuJoCo has other torques on joint '{worst.joint}' than the nominal equation that a diagnosis "
        f"of an articulated model works with, by {100.0 * worst.share:.3g} % of what acts there, from t = {worst.time:.4g} s on: "
        f"{culprit or 'something in the model beyond inertia, damping, springs, gravity and drives'} comes into play; take it out of the "
        "model and let the diagnosis look for it, or stay where it does not act"
    )


def _balance(case: Case, model: ArticulatedModel, record: CaseRecord, motion: Motion) -> Array:
    """Torque asked for less torque of the drive (n, n_joints), by the equations of the joints."""
    out = np.empty_like(motion.position)
    for j, joint in enumerate(model.joints):
        drive = joint.drive
        assert drive is not None
        command = record.values[input_of(case, joint).name]
        force = drive.kp * command
        if drive.servo:
            force = drive.kp * (command - motion.position[:, j]) - drive.kv * motion.velocity[:, j]
        out[:, j] = _needed(model, joint, j, motion) - drive.gear * np.clip(force, drive.low, drive.high)
    return out


def _balance_of_mujoco(
    case: Case,
    compiled: mujoco.MjModel,
    model: ArticulatedModel,
    record: CaseRecord,
    motion: Motion,
    picked: NDArray[np.intp],
) -> tuple[Array, Array]:
    """The same at some samples (n_picked, n_joints) as MuJoCo has it, and the RMS (n_joints,) of what acts on each joint."""
    data, out = mujoco.MjData(compiled), np.empty((len(picked), len(model.joints)))
    acting = np.zeros(len(model.joints))
    inputs = {joint.name: record.values[input_of(case, joint).name] for joint in model.joints}
    with native.quiet():
        for k, sample in enumerate(picked):
            for j, joint in enumerate(model.joints):
                assert joint.drive is not None
                data.qpos[joint.dof], data.qvel[joint.dof] = (
                    motion.position[sample, j],
                    motion.velocity[sample, j],
                )
                data.qacc[joint.dof] = motion.acceleration[sample, j]
                data.ctrl[compiled.actuator(joint.drive.name).id] = inputs[joint.name][sample]
            mujoco.mj_inverse(compiled, data)
            asked = np.array(data.qfrc_inverse)
            mujoco.mj_fwdPosition(compiled, data)
            mujoco.mj_fwdVelocity(compiled, data)
            _settle(compiled, data)
            mujoco.mj_fwdActuation(compiled, data)
            for j, joint in enumerate(model.joints):
                out[k, j] = asked[joint.dof] - data.qfrc_actuator[joint.dof]
                acting[j] += asked[joint.dof] ** 2 + data.qfrc_actuator[joint.dof] ** 2
    return out, np.sqrt(acting / len(picked))


def _settle(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Filters of actuators at what is commanded: their lag is no matter of a balance of forces."""
    for u in range(model.nu):
        if int(model.actuator_actnum[u]) == 1:
            data.act[int(model.actuator_actadr[u])] = data.ctrl[u]


def _culprit(
    case: Case,
    model: ArticulatedModel,
    compiled: mujoco.MjModel,
    record: CaseRecord,
    motion: Motion,
    j: int,
    settings: ComparisonSettings,
) -> str:
    """The item without which MuJoCo comes nearest to the equation of joint `j`; empty where none halves the difference."""
    picked = np.unique(np.linspace(0, len(record) - 1, settings.poses).astype(int))
    ours = _balance(case, model, record, motion)[picked, j]

    def distance(variant: mujoco.MjModel) -> float:
        theirs, _ = _balance_of_mujoco(case, variant, model, record, motion, picked)
        return float(np.sum((theirs[:, j] - ours) ** 2))

    whole, left = distance(compiled), {}
    for name, take in ITEMS.items():
        variant = copy.copy(compiled)
        take(variant)
        left[name] = distance(variant)
    best = min(left, key=lambda name: left[name])
    return best if left[best] < 0.5 * whole else ""
