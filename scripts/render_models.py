"""Render every camera of every rig to PNG, at rest and displaced, without a screen.

    python scripts/render_models.py --out out/models
    python scripts/render_models.py --models sdof joint --cameras overview
    python scripts/render_models.py --sheet docs/pictures/rigs.png

Needs EGL (Debian: `libegl1 libegl-mesa0`); set `MUJOCO_GL` to choose another way.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from bench import model_path
from bench.errors import BenchError, UnknownNameError

if TYPE_CHECKING:
    import mujoco

POSES: dict[str, dict[str, float]] = {
    "sdof": {"carriage": 0.03, "clamp": 0.006},
    "damper": {"piston": 0.12},
    "joint": {"axial_1": 0.012, "torsional_1": 0.45, "axial_2": -0.004, "torsional_2": -0.15},
    "joint_laboratory": {"axial_1": 0.005, "torsional_1": 0.2, "torsional_2": -0.02},
    "chain": {
        "axial_1": 0.012,
        "torsional_1": 0.4,
        "axial_2": 0.011,
        "torsional_2": 0.38,
        "torsional_3": -0.2,
    },
    "joint_6dof": {"x_1": 0.008, "rz_1": 0.03, "x": 0.012, "z": 0.008, "ry": 0.12, "rz": -0.1},
    "free_slide": {"carriage": 0.12},
}
"""Joint positions [m, rad] of the displaced picture, within each rig's working range."""


SHEET = ("sdof", "joint", "joint_laboratory", "damper", "chain", "joint_6dof")
"""Rigs of the picture in the documentation, row by row."""


@dataclass(frozen=True)
class Args:
    """Render the rigs.

    Attributes:
        out: Folder for the pictures, made where missing.
        models: Names of the rigs; all where empty.
        cameras: Names of the cameras; all of each rig where empty.
        width: Width of a picture [pixels].
        height: Height of a picture [pixels].
        displaced: Also render the displaced pose.
        sheet: File for one picture of the rigs side by side, at rest, and nothing else.
    """

    out: Path = Path("out/models")
    models: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    width: int = 1400
    height: int = 800
    displaced: bool = True
    sheet: Path | None = None


def pose(model: mujoco.MjModel, name: str) -> mujoco.MjData:
    """State of rig `name` in its displaced pose, kinematics done."""
    import mujoco

    data = mujoco.MjData(model)
    for joint, position in POSES.get(name, {}).items():
        data.joint(joint).qpos[0] = position
    mujoco.mj_forward(model, data)
    return data


def render(name: str, args: Args) -> list[Path]:
    """Write the pictures of one rig.

    Args:
        name: Name of the rig.
        args: Folder, size and choice of pictures.

    Returns:
        Paths of the PNG files.

    Raises:
        UnknownNameError: The rig, or one of the cameras asked for, does not exist.
    """
    import mujoco
    from matplotlib.image import imsave

    model = mujoco.MjModel.from_xml_path(str(model_path(name)))
    cameras = [model.camera(i).name for i in range(model.ncam)]
    for camera in args.cameras:
        if camera not in cameras:
            raise UnknownNameError(f"camera of rig '{name}'", camera, cameras)
    rest = mujoco.MjData(model)
    mujoco.mj_forward(model, rest)
    states = {"rest": rest} | ({"displaced": pose(model, name)} if args.displaced else {})

    paths = []
    with mujoco.Renderer(model, args.height, args.width) as renderer:
        for camera in args.cameras or cameras:
            for label, data in states.items():
                renderer.update_scene(data, camera=camera)
                path = args.out / f"{name}-{camera}-{label}.png"
                imsave(path, renderer.render())
                paths.append(path)
    return paths


def sheet(path: Path) -> None:
    """Write the rigs of `SHEET` into one picture, two side by side."""
    import mujoco
    import numpy as np
    from PIL import Image

    pictures = []
    for name in SHEET:
        model = mujoco.MjModel.from_xml_path(str(model_path(name)))
        with mujoco.Renderer(model, 352, 616) as renderer:
            renderer.update_scene(pose(model, ""), camera="overview")
            pictures.append(renderer.render())
    whole = np.vstack([np.hstack(pictures[k : k + 2]) for k in range(0, len(pictures), 2)])
    Image.fromarray(whole).quantize(256).save(path, optimize=True)


def main(args: Args) -> None:
    """Render what was asked for and print the paths."""
    os.environ.setdefault("MUJOCO_GL", "egl")
    if args.sheet is not None:
        sheet(args.sheet)
        print(args.sheet)
        return
    args.out.mkdir(parents=True, exist_ok=True)
    try:
        for name in args.models or tuple(
            sorted(path.stem for path in model_path("sdof").parent.glob("*.xml"))
        ):
            for path in render(name, args):
                print(path)
    except BenchError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(tyro.cli(Args))
