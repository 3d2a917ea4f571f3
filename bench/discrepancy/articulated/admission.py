"""What has to hold before an articulated model is fitted: units by the model, its values in place, nothing of it left out where it acts,
and no factor and no sign that is one of the recording.

Factors and signs are those of `against_model`, what the equations of the joints leave out that of `against_mujoco`.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from bench.discrepancy.articulated.against_model import suspicions
from bench.discrepancy.articulated.against_mujoco import ComparisonSettings, left_out
from bench.discrepancy.articulated.nominal_values import with_nominal_values
from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.load_limits import clipped_case
from bench.discrepancy.checks.nominal_values import value_notes
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.model.model_units import in_model_units
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of, loads_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import motion_of
from bench.discrepancy.settings import (
    DEFAULT,
    DiagnosisSettings,
)
from bench.errors import FileFormatError, ModelError, RecordingError, UnitError


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
    case, said = in_model_units(declared, rig)
    compiled = with_nominal_values(rig, case.parameters)
    case = bound(case, compiled)
    model = ArticulatedModel.of(compiled, case.rig)
    _refuse(case, model, settings)
    case, clipped = _within_ranges(case, model)
    records = (*case.identification, *case.validation)
    moving = [(record, motion_of(case, model, record, {}, settings=settings.motion)) for record in records]
    doubts = suspicions(declared, case, model, moving[: len(case.identification)], settings.checks)
    for first in doubts:
        if not anyway:
            more = f" (and {len(doubts) - 1} more such)" if len(doubts) > 1 else ""
            raise UnitError(f"{first}{more}; --anyway diagnoses the records as they are")
    apart = left_out(case, model, compiled, moving, ComparisonSettings(like=settings.checks.likeness))
    if apart and not anyway:
        raise ModelError(f"{apart}; --anyway diagnoses with the nominal model all the same")
    doubts = (*doubts, apart) if apart else doubts
    return AdmittedRobot(
        case, compiled, (*said, *clipped, *value_notes(case, rig, settings=settings.model), *doubts)
    )


def _refuse(case: Case, model: ArticulatedModel, settings: DiagnosisSettings) -> None:
    """Refuse records that no diagnosis can use."""
    for record in (*case.identification, *case.validation):
        if record.step >= settings.articulated.longest_sample:
            raise RecordingError(
                f"'{record.name}' has {record.step:.4g} s between its samples, in which a joint does whatever it likes; "
                f"under {settings.articulated.longest_sample:g} s are expected: is its time column in milliseconds?"
            )
    for tie in model.ties:
        for channel in case.channels:
            if channel.target == f"joint:{tie.name}":
                raise FileFormatError(
                    f"'{channel.name}' measures joint '{tie.name}', which joint '{tie.to}' moves by an equality of the model; measure "
                    f"'{tie.to}', or exchange joint1 and joint2 of the equality"
                )
    inputs = [c.name for joint in model.joints for c in (input_of(case, joint), *loads_of(case, joint))]
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
