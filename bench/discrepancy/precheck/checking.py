"""The check of a case: may it be diagnosed, what is doubtful about its records, what can they tell."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.checks.data_quality import doubts
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.precheck.drives import drive_doubts
from bench.discrepancy.precheck.information import Told, effects_told, parameters_told, shortened
from bench.discrepancy.precheck.joint_information import joints_told
from bench.discrepancy.precheck.joints import admitted_joints, joint_doubts
from bench.discrepancy.precheck.loads import load_doubts
from bench.discrepancy.precheck.motions import motion_doubts
from bench.discrepancy.precheck.samples import sample_doubts
from bench.discrepancy.precheck.settings import CheckSettings
from bench.errors import BenchError

Readiness = Literal["ready", "doubtful", "unusable"]


@dataclass(frozen=True)
class CheckingSettings:
    """Numbers of `bench.discrepancy.precheck.checking`."""

    status: Mapping[str, int] = field(default_factory=lambda: {"ready": 0, "doubtful": 1, "unusable": 2})
    """Exit status of each word."""


SETTINGS = CheckingSettings()
UNUSED = "columns that nominal.json does not name are not used"
"""Beginning of a note that is no doubt."""
DONE = ("; converted to ", "counted from", "changes nothing: its joint is")
"""Parts of what admission says that tell of something done, of which nothing can be wrong."""


@dataclass(frozen=True)
class Checked:
    """What a check says.

    Attributes:
        word: "ready"; "doubtful", where it may be diagnosed but something may be wrong; "unusable".
        doubts: What is wrong, a sentence each, with what to do.
        notes: What was done to the records or is left open.
        parameters: How well the records tell the nominal parameters.
        effects: How well they tell the effects of the catalogue.
        seconds: Time it took [s].
    """

    word: Readiness
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    parameters: tuple[Told, ...] = ()
    effects: tuple[Told, ...] = ()
    seconds: float = math.nan

    @property
    def status(self) -> int:
        """Exit status."""
        return SETTINGS.status[self.word]

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "word": self.word,
            "doubts": list(self.doubts),
            "notes": list(self.notes),
            "parameters": [told._asdict() for told in self.parameters],
            "effects": [told._asdict() for told in self.effects],
            "seconds": self.seconds,
        }


def check_folder(
    folder: str | Path, settings: CheckSettings | None = None, *, informed: bool = True
) -> Checked:
    """Check the case in a folder; what cannot be read is told as unusable."""
    began = time.perf_counter()
    try:
        case = read_case(folder)
    except BenchError as error:
        return Checked("unusable", (str(error),), seconds=time.perf_counter() - began)
    found = check(case, settings, informed=informed)
    return replace(found, seconds=time.perf_counter() - began)


def check(case: Case, settings: CheckSettings | None = None, *, informed: bool = True) -> Checked:
    """Check a case before any fit.

    Args:
        case: The case.
        settings: When something counts.
        informed: Whether what the records can tell is computed.
    """
    began = time.perf_counter()
    own = settings or CheckSettings()
    said = _of_files(case)
    found = list(sample_doubts(case, own))
    notes: tuple[str, ...] = tuple(note for note in said if note.startswith(UNUSED))
    found = [note for note in said if not note.startswith(UNUSED)] + found
    brief = shortened(case, own.records_seconds)
    if applies(case):
        return _of_joints(case, own, found, notes, began, informed=informed)
    try:
        told, admission = admitted(brief)
    except BenchError as error:
        return Checked("unusable", (str(error), *found), notes, seconds=time.perf_counter() - began)
    problem = Problem(told, structure_of(told), told.identification)
    wrong, done = _of_admission(admission)
    notes = (*notes, *done)
    found += [*wrong, *doubts(told, problem)]
    found += [*motion_doubts(problem, own), *load_doubts(problem, own)]
    parameters: list[Told] = []
    effects: list[Told] = []
    if informed:
        parameters, columns = parameters_told(problem, own)
        effects = effects_told(told, problem, columns, own)
        found += _of_information(parameters, effects)
    return replace(_said(found, notes, began), parameters=tuple(parameters), effects=tuple(effects))


def _of_joints(
    case: Case,
    settings: CheckSettings,
    found: list[str],
    notes: tuple[str, ...],
    began: float,
    *,
    informed: bool,
) -> Checked:
    """The check of an articulated model."""
    own, model, said = admitted_joints(shortened(case, settings.motion_seconds))
    wrong, done = _of_admission(said)
    found, notes = [*found, *wrong], (*notes, *done)
    if own is None or model is None:
        return Checked("unusable", tuple(found), notes, seconds=time.perf_counter() - began)
    found += joint_doubts(own, model)
    own = shortened(own, settings.records_seconds)
    found += drive_doubts(own, model, settings)
    parameters: list[Told] = []
    effects: list[Told] = []
    if informed:
        try:
            parameters, effects = joints_told(own, model, settings)
        except BenchError as error:
            notes = (*notes, f"what the records tell of parameters is not computed: {error}")
        found += _of_information(parameters, effects)
    return replace(_said(found, notes, began), parameters=tuple(parameters), effects=tuple(effects))


def _of_information(parameters: list[Told], effects: list[Told]) -> list[str]:
    """Doubts about records that tell too little."""
    found = []
    if parameters and all(one.word == "not identifiable" for one in parameters):
        found.append(
            "these records tell none of the nominal parameters: excite more strongly, or in another band"
        )
    if effects and not any(one.word == "identifiable" for one in effects):
        found.append(
            "these records would not show any effect of the catalogue: excite more strongly, or measure with less noise"
        )
    return found


def _said(found: list[str], notes: tuple[str, ...], began: float) -> Checked:
    unique = tuple(dict.fromkeys(found))
    return Checked("doubtful" if unique else "ready", unique, notes, seconds=time.perf_counter() - began)


def _of_files(case: Case) -> list[str]:
    """What was repaired or is doubtful in the files."""
    records: tuple[CaseRecord, ...] = (*case.identification, *case.validation)
    said = [(record.name, note) for record in records for note in record.notes]
    return [note if note.startswith(UNUSED) else f"{name}: {note}" for name, note in said]


def _of_admission(said: Sequence[str]) -> tuple[list[str], list[str]]:
    """What admission says that is a doubt, and what it only did."""
    done = [note for note in said if any(part in note for part in DONE)]
    return [note for note in said if note not in done], done
