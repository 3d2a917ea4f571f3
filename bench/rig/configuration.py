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

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.documents import checked, naming
from bench.rig.description import Rig
from bench.rig.element import Element
from bench.rig.schema import RIGS, ElementDocument, RigDocument

__all__ = ["RIGS", "element_from_configuration", "read_rig", "rig_from_configuration"]


def read_rig(path: str | Path) -> tuple[RigDocument, Rig]:
    """Read a rig's file, TOML or JSON.

    Returns:
        The document, and the rig that it describes.

    Raises:
        FileFormatError: It cannot be read.
        DocumentError: An entry is not known, missing, of the wrong kind or out of range; the message names the place.
        ModelError: The MJCF cannot be read.
    """
    document = RigDocument.read(path)
    with naming(str(path)):
        return document, document.build(Path(path).parent)


def element_from_configuration(entry: Mapping[str, Any]) -> Element:
    """One entry of `elements`: a law, joints, and parameters by name (or `theta` in order).

    Raises:
        DocumentError: An entry, law or parameter is not known, missing, of the wrong kind or out of range.
    """
    return checked(ElementDocument, entry).element()


def rig_from_configuration(document: Mapping[str, Any], *, folder: str | Path = ".") -> Rig:
    """Build the rig that a document describes.

    Args:
        document: Entries as in the module's example.
        folder: Folder that an MJCF path is relative to.

    Raises:
        DocumentError: An entry, rig, law, parameter or structural quantity is not known, missing, of the wrong kind or out of
            range.
        ModelError: The MJCF cannot be read.
    """
    return checked(RigDocument, document).build(folder)
