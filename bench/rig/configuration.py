"""Rigs as configuration: a JSON or TOML document names a rig, its structure, its elements and what drives it.

```toml
rig = "sdof"                       # a rig of the bench, or the path of an MJCF file
timestep = 1e-3                    # optional [s]
integrator = "RK4"                 # optional
structure.mass.carriage = 2.0      # optional, as `Rig.with_structure`
[[elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = 3000.0, clearance = 0.005 }
[excitation]                       # optional, as `Excitation.from_dict`
duration = 10.0
sample_rate = 1000.0
signals.shaker = { type = "harmonic", amplitude = 5.0, frequency = 2.0 }
```
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bench.errors import FileFormatError, ParameterError, UnknownNameError
from bench.laws import find_law
from bench.rig.description import Rig
from bench.rig.element import Element
from bench.rig.library import chain_rig, damper_rig, joint_rig, laboratory_joint_rig, sdof_rig, six_dof_rig

RIGS: Mapping[str, Callable[..., Rig]] = {
    "sdof": sdof_rig,
    "damper": damper_rig,
    "joint": joint_rig,
    "joint_laboratory": laboratory_joint_rig,
    "chain": chain_rig,
    "joint_6dof": six_dof_rig,
}
"""The rigs of the bench by name."""

_ENTRIES = (
    "rig", "name", "timestep", "integrator", "structure", "elements", "excitation", "experiment", "seed"
)  # fmt: skip


def read_document(path: str | Path) -> dict[str, Any]:
    """Read a TOML or JSON document.

    Raises:
        FileFormatError: It cannot be read, or is neither.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
        document = json.loads(text) if file.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise FileFormatError(
            f"cannot read {file} as a {'JSON' if file.suffix == '.json' else 'TOML'} document: {error}"
        ) from error
    if not isinstance(document, dict):
        raise FileFormatError(f"{file} holds a {type(document).__name__}; a table of entries is expected")
    return document


def element_from_configuration(entry: Mapping[str, Any]) -> Element:
    """One entry of `elements`: a law, joints, and parameters by name (or `theta` in order).

    Raises:
        UnknownNameError: Of the law or a parameter, or an entry that is not known.
        ParameterError: An entry is missing.
    """
    known = ("law", "header", "joints", "inputs", "parameters", "theta", "name", "exact")
    for key in entry:
        if key not in known:
            raise UnknownNameError("entry of an element", key, known)
    missing = [key for key in ("law", "joints") if key not in entry]
    if missing:
        raise ParameterError(
            f"an element needs the entries law and joints; {', '.join(missing)} missing in {dict(entry)}"
        )
    return Element.of(
        find_law(entry["law"], entry.get("header", ())),
        *entry["joints"],
        theta=entry.get("theta"),
        inputs=tuple(entry.get("inputs", ())),
        name=entry.get("name", ""),
        exact=bool(entry.get("exact", False)),
        **entry.get("parameters", {}),
    )


def rig_from_configuration(document: Mapping[str, Any], *, folder: str | Path = ".") -> Rig:
    """Build the rig that a document describes.

    Args:
        document: Entries as in the module's example.
        folder: Folder that an MJCF path is relative to.

    Raises:
        UnknownNameError: An entry, rig, law, parameter or structural quantity is not known.
        ParameterError: An entry is missing or out of range.
        ModelError: The MJCF cannot be read.
    """
    for key in document:
        if key not in _ENTRIES:
            raise UnknownNameError("entry of a rig configuration", key, _ENTRIES)
    if "rig" not in document:
        raise ParameterError(
            f"a rig configuration needs the entry rig: one of {', '.join(RIGS)}, or the path of an MJCF file"
        )
    elements = [element_from_configuration(entry) for entry in document.get("elements", ())]
    settings = {key: document[key] for key in ("timestep", "integrator") if key in document}
    which = str(document["rig"])
    if which in RIGS:
        rig = RIGS[which](*elements, **settings)
    elif which.endswith(".xml"):
        rig = Rig.from_file(Path(folder) / which, *elements, **settings)
    else:
        raise UnknownNameError("rig (or path ending in .xml)", which, RIGS)
    structure = document.get("structure", {})
    if structure:
        rig = rig.with_structure(**structure)
    return rig.with_(name=document["name"]) if "name" in document else rig
