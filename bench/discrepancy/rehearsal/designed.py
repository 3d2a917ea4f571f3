"""Signals that were designed for a case: what was weighed, what was chosen, and how they are written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.model_units import DeclaredUnit
from bench.files import together, write_text

NAMES = ("identification", "identification_2", "validation")
"""Names of the records."""


@dataclass(frozen=True)
class Tried:
    """A signal at a size that the rig can do.

    Attributes:
        label: What it is, in words.
        information: What its record would tell [nat].
        commands: Largest magnitude by command channel.
        responses: The same by response channel.
        record: Commands and predicted responses, in the units of the model.
    """

    label: str
    information: float
    commands: dict[str, float]
    responses: dict[str, float]
    record: CaseRecord

    def shown_in(self, units: Mapping[str, DeclaredUnit]) -> Tried:
        """The same with magnitudes in the units that channels were declared in."""
        of = [
            {n: x / abs(units[n].factor) for n, x in part.items()} for part in (self.commands, self.responses)
        ]
        return replace(self, commands=of[0], responses=of[1])


@dataclass(frozen=True)
class Designed:
    """Signals for a case.

    Attributes:
        tried: All that were weighed, the most telling first.
        chosen: Labels of those for `NAMES`.
        inputs: Command channels and the units that they were declared in.
    """

    tried: tuple[Tried, ...]
    chosen: tuple[str, ...]
    inputs: Mapping[str, DeclaredUnit]

    @property
    def records(self) -> dict[str, CaseRecord]:
        """Records by name of their file."""
        found = {one.label: one.record for one in self.tried}
        return {name: found[label] for name, label in zip(NAMES, self.chosen, strict=True)}

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        tried = [
            {"label": t.label, "information": t.information, "commands": t.commands, "responses": t.responses}
            for t in self.tried
        ]
        return {"chosen": dict(zip(NAMES, self.chosen, strict=True)), "tried": tried}


def write_design(made: Designed, source: Path, folder: Path) -> list[Path]:
    """Write the case with its signals: nominal.json and the model as they were, and a CSV of the commands for each record."""
    nominal = source / "nominal.json"
    rig = str(json.loads(nominal.read_text(encoding="utf-8"))["rig"])
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "nominal.json", folder / rig]
    with together():
        for path, text in zip(
            written, (nominal.read_text("utf-8"), (source / rig).read_text("utf-8")), strict=True
        ):
            write_text(path, text)
        for name, record in made.records.items():
            headings = ["time [s]", *(f"{channel} [{own.unit}]" for channel, own in made.inputs.items())]
            columns = np.column_stack(
                [record.time, *(record.values[channel] / own.factor for channel, own in made.inputs.items())]
            )
            rows = [",".join(f"{x:.9g}" for x in row) for row in columns]
            written.append(folder / f"{name}.csv")
            write_text(written[-1], "\n".join([",".join(headings), *rows]) + "\n")
    return written
