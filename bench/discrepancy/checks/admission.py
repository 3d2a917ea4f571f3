"""What has to hold before anything is fitted: units by the model, limits of the model applied, no factor and no sign that is one of the
recording, and a nominal simulation that is the user's model."""

from __future__ import annotations

from typing import NamedTuple

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.free_decay import is_free_decay, with_no_load
from bench.discrepancy.checks.counting import counted_from_rest
from bench.discrepancy.checks.data_quality import refuse_unusable
from bench.discrepancy.checks.initial_motion import with_starts_found
from bench.discrepancy.checks.like_mujoco import unlike_mujoco
from bench.discrepancy.checks.load_limits import within_limits
from bench.discrepancy.checks.nominal_values import value_notes
from bench.discrepancy.checks.prescribed_loads import with_accelerations
from bench.discrepancy.checks.reference import actuators_of, reference_of
from bench.discrepancy.checks.scales import suspicions
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.model.model_units import in_model_units
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings
from bench.errors import ModelError, UnitError


class Admitted(NamedTuple):
    """A case that may be diagnosed.

    Attributes:
        case: In the units of its model, its loads within the model's limits.
        notes: What was done to it or is doubtful about it, a sentence each.
    """

    case: Case
    notes: tuple[str, ...]


def admitted(declared: Case, *, anyway: bool = False, settings: DiagnosisSettings = DEFAULT) -> Admitted:
    """Admit a case to the diagnosis.

    Args:
        declared: The case as read.
        anyway: Whether what is doubtful is noted rather than refused.
        settings: Thresholds of the diagnosis.

    Raises:
        UnitError: A unit does not fit, or a channel is off by a factor or a sign.
        ModelError: The model holds what the nominal simulation cannot, and it comes into play.
        RecordingError: Nothing moves the rig, or nothing is measured.
        IdentificationError: The nominal model diverges.
    """
    own = declared.rig.endswith(".xml")
    declared = (
        with_no_load(declared) if is_free_decay(declared) and not _driven_by_name(declared) else declared
    )
    rig, reference = rig_of(declared) if own else None, None
    case, said = in_model_units(declared, rig)
    if rig is not None:
        case, driven = with_accelerations(case, rig, settings=settings.motion)
        case, limited = within_limits(
            case, rig, actuators_of(case, rig, settings=settings.model), settings=settings.model
        )
        reference = reference_of(case, rig, settings=settings.model)
        case, shifted = counted_from_rest(case, reference)
        said = (*said, *driven, *limited, *shifted, *value_notes(case, rig, settings=settings.model))
    case = with_starts_found(case, settings=settings)
    problem = Problem(case, structure_of(case, settings=settings), case.identification, settings=settings)
    refuse_unusable(problem)
    said = (*said, *_parts_alone(case), *_factors(case))
    doubts = suspicions(declared, problem)
    for first in doubts:
        if not anyway:
            more = f" (and {len(doubts) - 1} more such)" if len(doubts) > 1 else ""
            raise UnitError(f"{first}{more}; --anyway diagnoses the records as they are")
    if reference is not None:
        apart = unlike_mujoco(problem, reference, (*case.identification, *case.validation))
        if apart and not anyway:
            raise ModelError(f"{apart}; --anyway diagnoses with the nominal model all the same")
        doubts = (*doubts, apart) if apart else doubts
    return Admitted(case, (*said, *doubts))


def _parts_alone(case: Case) -> tuple[str, ...]:
    types = sorted({entry.alike for entry in case.parameters if entry.alike})
    if not types:
        return ()
    named = ", ".join(f"'{name}'" for name in types)
    return (
        f"the joints of this model do not carry one another; what parts of type {named} have in common is not used, and each of their "
        "numbers is taken as known to its std",
    )


def _factors(case: Case) -> tuple[str, ...]:
    return tuple(
        f"'{entry.name}' is stated to be known to a factor of {entry.factor:g}; the joints of this model do not carry one another, and it "
        f"is taken as known to {entry.std:.3g} (one sigma)"
        for entry in case.parameters
        if entry.factor > 1.0
    )


def _driven_by_name(case: Case) -> bool:
    """Whether a channel of a user's own model is a load by nothing but the name of an actuator."""
    return case.rig.endswith(".xml") and any(
        c.name in rig_of(case).actuators and not c.target for c in case.channels
    )
