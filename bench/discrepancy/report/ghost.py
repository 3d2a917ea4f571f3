"""The user's model with the measured motion as a ghost over it, for the viewer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco

from bench.errors import ModelError
from bench.rig import Rig

PREFIX = "measured/"


@dataclass(frozen=True)
class GhostSettings:
    """Numbers of `bench.discrepancy.report.ghost`."""

    colour: tuple[float, ...] = (0.85, 0.85, 0.85, 0.35)
    """Red, green, blue and opacity: pale on the viewer's dark ground, and what stands behind it is seen."""


SETTINGS = GhostSettings()


def with_ghost(path: str | Path) -> Rig:
    """A rig whose model stands twice in the same place: as it is, and pale, each with joints of its own.

    Joint positions of the rig are those of the model, followed by those of the ghost.

    Args:
        path: The MJCF.

    Raises:
        ModelError: MuJoCo does not read it, or cannot hold it twice.
    """
    try:
        spec, ghost = (mujoco.MjSpec.from_file(str(path)) for _ in range(2))
        for kind in ("keys", "actuators", "sensors", "equalities", "excludes", "pairs"):
            for one in list(getattr(ghost, kind)):
                ghost.delete(one)
        for one in (*ghost.worldbody.geoms, *ghost.lights, *ghost.cameras):
            ghost.delete(one)
        for geom in ghost.geoms:
            geom.rgba, geom.material = SETTINGS.colour, ""
            geom.contype = geom.conaffinity = 0
        spec.attach(ghost, prefix=PREFIX, frame=spec.worldbody.add_frame())
        for key in list(spec.keys):
            spec.delete(key)
        spec.compile()
        folder = str(Path(path).parent)
        return Rig(Path(path).stem, spec.to_xml(), timestep=float(spec.option.timestep), folder=folder)
    except ValueError as error:
        raise ModelError(f"'{path}' cannot be drawn twice: {' '.join(str(error).split())}") from None
