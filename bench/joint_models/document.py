"""The file of an identified joint: a law, its parameters, where it goes, what it was identified on and how well it does."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.documents import Document, Label, Listed, Name, Number
from bench.documents.loading import load_document
from bench.errors import FileFormatError
from bench.files import json_values, write_text
from bench.identification.validity_range import ValidityRange
from bench.laws.registry import find_law
from bench.rig.element import Element

FORMAT = "jointbench-joint-1"
"""Name and version of the format."""


class JointDocument(Document):
    """An identified joint."""

    entry_name = "an identified joint"
    format: Name
    """"jointbench-joint-1"."""
    kind: Name
    """Kind of the model."""
    law: Name
    """Name of its law."""
    header: Listed[Number] = ()
    """Size of the law."""
    theta: Listed[Number]
    """Parameters of the law."""
    joints: Listed[Name]
    """Joints or fixed tendons that it acts on."""
    name: Label = ""
    """Name of the element."""
    range: dict[str, Any] | None = None
    """Range of the states it was identified from."""
    report: dict[str, Any] | None = None
    """How its identification went."""
    source: dict[str, Any] | None = None
    """Records and channels it comes from."""
    scores: dict[str, Any] | None = None
    """NMSE of its forces [%]."""


@dataclass(frozen=True)
class JointFile:
    """An identified joint.

    Attributes:
        kind: Kind of the model.
        element: It, ready to be put into a rig.
        report: How its identification went.
        source: Records and channels that it comes from.
        scores: NMSE of its forces [%], by what they were judged on.
    """

    kind: str
    element: Element
    report: Mapping[str, Any] = field(default_factory=dict)
    source: Mapping[str, Any] = field(default_factory=dict)
    scores: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The file's JSON values; numbers survive to the last bit."""
        own, validity = self.element, self.element.validity
        return {
            "format": FORMAT,
            "kind": self.kind,
            "law": own.law.name,
            "header": list(own.law.header),
            "theta": [float(x) for x in own.theta[len(own.law.header) :]],
            "joints": list(own.joints),
            "name": own.name,
            "range": validity.to_dict() if isinstance(validity, ValidityRange) else None,
            "report": dict(self.report),
            "source": dict(self.source),
            "scores": dict(self.scores),
        }


def write_joint(path: str | Path, joint: JointFile) -> None:
    """Write an identified joint, whole or not at all."""
    text = json.dumps(json_values(joint.to_dict()), indent=1, ensure_ascii=False, allow_nan=False)
    write_text(path, text + "\n")


def read_joint(path: str | Path) -> JointFile:
    """Read an identified joint.

    Raises:
        FileFormatError: It cannot be read, or is no identified joint.
        DocumentError: An entry is missing or of the wrong kind.
    """
    if load_document(path).get("format") != FORMAT:
        raise FileFormatError(
            f"'{path}' is no identified joint ('format' is not '{FORMAT}'); `jointbench identify` writes them"
        )
    found = JointDocument.read(path)
    law = find_law(found.law, found.header)
    try:
        validity = None if found.range is None else ValidityRange.from_dict(found.range)
    except (KeyError, TypeError, ValueError) as error:
        raise FileFormatError(f"'{path}': its range cannot be read: {error!r}") from None
    element = Element(law, tuple(found.joints), law.theta(found.theta), name=found.name, validity=validity)
    return JointFile(found.kind, element, found.report or {}, found.source or {}, found.scores or {})
