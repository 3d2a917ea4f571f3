"""An identified joint in the place of the true one: the rig's document with it, and both rigs driven alike."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.documents.loading import load_document
from bench.errors import ParameterError, UnknownNameError
from bench.joint_models.document import FORMAT, JointFile, read_joint
from bench.reduction import Comparison, compare
from bench.rig.configuration import read_rig
from bench.rig.description import Rig
from bench.rig.element import Element


def replaced_by(elements: Sequence[Element], joint: Element, asked: Sequence[str] = ()) -> list[str]:
    """Names of the elements that a joint takes the place of: those asked for, the one of its name, else those on its joints.

    Raises:
        UnknownNameError: An element that was asked for is not there.
    """
    names = [element.name for element in elements]
    for name in asked:
        if name not in names:
            raise UnknownNameError("element of the rig", name, names)
    if asked:
        return list(asked)
    if joint.name in names:
        return [joint.name]
    return [element.name for element in elements if set(element.joints) & set(joint.joints)]


def swapped(
    path: Path, joint: JointFile, folder: Path, asked: Sequence[str] = ()
) -> tuple[dict[str, Any], list[str]]:
    """The document of a rig with the joint in it, to stand in a folder, and the names of the elements that went.

    Raises:
        FileFormatError: The rig cannot be read.
        DocumentError: It is none.
        UnknownNameError: An element is not there.
    """
    own = joint.element
    entry = {
        "law": own.law.name,
        "header": list(own.law.header),
        "joints": list(own.joints),
        "theta": [float(x) for x in own.theta[len(own.law.header) :]],
        "name": own.name,
    }
    if path.suffix == ".xml":
        Rig.from_file(path, own).model  # noqa: B018  (it compiles with the joint in it)
        return {"rig": os.path.relpath(path, folder), "elements": [entry]}, []
    document, rig = read_rig(path)
    gone = replaced_by(rig.elements, own, asked)
    data = load_document(path)
    kept = [
        raw
        for raw, element in zip(data.get("elements", []), document.elements, strict=True)
        if element.element().name not in gone
    ]
    rig.with_(elements=(*(e for e in rig.elements if e.name not in gone), own)).model  # noqa: B018
    if str(data["rig"]).endswith(".xml"):
        data["rig"] = os.path.relpath(path.parent / data["rig"], folder)
    return {**data, "elements": [*kept, entry]}, gone


def compared(path: Path, reduced: Path, seed: int | None) -> tuple[dict[str, Rig], Comparison]:
    """Drive a rig and its reduced twin alike.

    Args:
        path: The rig with its excitation.
        reduced: An identified joint, or a rig.
        seed: Seed of the excitation; that of the rig's file, or 0, where None.

    Raises:
        ParameterError: Nothing drives the rig.
    """
    document, rig = read_rig(path)
    if document.drive is None:
        raise ParameterError(
            f"{path} has no [excitation]; say what drives the rig (see docs/configuration.md)"
        )
    if load_document(reduced).get("format") == FORMAT:
        joint = read_joint(reduced).element
        gone = replaced_by(rig.elements, joint)
        twin = rig.with_(elements=(*(e for e in rig.elements if e.name not in gone), joint))
    else:
        twin = read_rig(reduced)[1]
    return {"true": rig, "reduced": twin}, compare(
        rig, twin, document.drive, seed=(document.seed or 0) if seed is None else seed
    )
