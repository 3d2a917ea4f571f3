"""The command that writes the JSON Schemas of the bench's documents, by which editors complete and check them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from bench.cli.console import emit


class DocumentKind(NamedTuple):
    """A kind of document.

    Attributes:
        about: What it is.
        module: Module of its model.
        model: Name of its model.
    """

    about: str
    module: str
    model: str


KINDS: dict[str, DocumentKind] = {
    "rig": DocumentKind("a rig for `simulate` and `view`", "bench.rig.schema", "RigDocument"),
    "excitation": DocumentKind(
        "a rig with an [experiment] for `excite`", "bench.excitation.schema", "ExcitationRequest"
    ),
    "plan": DocumentKind("a plan for `campaign`", "bench.campaign.schema", "PlanDocument"),
    "nominal": DocumentKind(
        "nominal.json of a case for `diagnose`", "bench.discrepancy.case.schema", "NominalDocument"
    ),
    "verdict": DocumentKind(
        "what `diagnose --json` writes", "bench.discrepancy.verdict_schema", "VerdictDocument"
    ),
    "settings": DocumentKind(
        "thresholds for `diagnose --settings`", "bench.discrepancy.settings.document", "SettingsDocument"
    ),
    "protocol": DocumentKind(
        "protocol.json of a sealed case", "bench.discrepancy.blind.schema", "ProtocolDocument"
    ),
    "answer": DocumentKind("the answer of a sealed case", "bench.discrepancy.blind.schema", "AnswerDocument"),
    "manifest": DocumentKind(
        "manifest.json of a campaign", "bench.campaign.manifest_schema", "ManifestDocument"
    ),
    "policy": DocumentKind("the header of a trained policy", "bench.excitation.schema", "PolicyHeader"),
}
"""Kinds of documents by name."""

FOLDER = Path(__file__).resolve().parent.parent / "_data" / "schemas"


def generated(name: str) -> dict[str, Any]:
    """The schema of a kind of document, made from its model."""
    kind = KINDS[name]
    made = getattr(import_module(kind.module), kind.model).model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made}


def text_of(schema: dict[str, Any]) -> str:
    """A schema as the text of its file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


@dataclass
class Schema:
    """Write the JSON Schema of a kind of document, by which an editor completes and checks it."""

    name: tyro.conf.Positional[str] = ""
    """Kind of document; --list tells which there are."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File for the schema; printed where not given."""
    force: bool = False
    """Overwrite a file that exists."""
    list: bool = False
    """List the kinds of documents."""
    json: bool = False
    """Print JSON: the list, or what was written."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.errors import ParameterError, UnknownNameError
        from bench.files import write_text
        from bench.targets import check_targets

        if self.list:
            self._tell_kinds()
            return
        if not self.name:
            raise ParameterError(f"name a kind of document: {', '.join(KINDS)} (--list describes them)")
        if self.name not in KINDS:
            raise UnknownNameError("kind of document", self.name, KINDS)
        check_targets(self.out, force=self.force)
        text = (FOLDER / f"{self.name}.json").read_text(encoding="utf-8")
        if self.out is None or str(self.out) == "-":
            print(text, end="")
            return
        write_text(self.out, text)
        if self.json:
            emit({"name": self.name, "file": str(self.out)})
        else:
            print(
                f'{self.out}: name it in a document as "$schema" (JSON), or in a comment "#:schema {self.out}" (TOML)'
            )

    def _tell_kinds(self) -> None:
        if self.json:
            emit([{"name": name, "about": kind.about} for name, kind in KINDS.items()])
            return
        table = Table("name", "document")
        for name, kind in KINDS.items():
            table.add_row(name, Text(kind.about))
        Console().print(table)
