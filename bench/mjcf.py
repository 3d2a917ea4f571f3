"""The MJCF files that come with the bench, and the words of MJCF that documents use."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from bench.errors import UnknownNameError

IntegratorName = Literal["RK4", "Euler", "implicit", "implicitfast"]
"""Integrators of MuJoCo."""
StructureName = Literal["mass", "inertia", "stiffness", "damping", "frictionloss", "armature"]
"""Structural quantities of a model that a document may change."""


def model_path(name: str) -> Path:
    """Path of one of the bench's MJCF models.

    Args:
        name: Name without suffix: "sdof", "damper", "joint", "joint_laboratory", "chain", "joint_6dof", …

    Raises:
        UnknownNameError: There is no such model.
    """
    here = Path(__file__).resolve().parent
    folder = (
        here / "_models" if (here / "_models").is_dir() else here.parent / "models"
    )  # wheel, or source tree
    path = folder / f"{name}.xml"
    if not path.is_file():
        raise UnknownNameError("model", name, [file.stem for file in folder.glob("*.xml")])
    return path
