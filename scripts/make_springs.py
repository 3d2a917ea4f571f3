"""Write the coil springs of the rigs: skins that stretch and twist with the two bodies they join.

A coil is drawn as a MuJoCo skin whose vertices follow two bodies with weights that go linearly from one end to the
other, so that it deforms like a spring and adds no degree of freedom, no mass and no force. Each skin `NAME` of a model
runs from site `NAME_start` to site `NAME_end` at rest; the first size of the first site is the radius of the coil, the
second, where there is one, that of the wire.

Run it after moving a site or a body that a spring ends on::

    python scripts/make_springs.py
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import tyro
from numpy.typing import NDArray

from bench import model_path
from bench.files import write_bytes

SIDES = 6
"""Corners of the wire's cross-section."""

RINGS_PER_TURN = 14
"""Cross-sections in one turn of the coil."""

BODY_NAME_BYTES = 40
"""Length of the body name in a skin file, fixed by MuJoCo's format."""


@dataclass(frozen=True)
class Args:
    """Write the skin file of every coil spring.

    Attributes:
        models: Folder that holds the MJCF files.
    """

    models: Path = model_path("sdof").parent


def coil(
    length: float, radius: float, wire: float
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]:
    """A helical wire along x with closed ends, as a triangle mesh.

    Args:
        length: Distance between the two end faces [m].
        radius: Radius of the wire's centre line [m].
        wire: Radius of the wire [m].

    Returns:
        Vertices (n, 3) [m] from x = 0 to x = length, triangles (n_faces, 3), and for each vertex its place along the
        spring (n,), 0 at the start and 1 at the end.
    """
    turns = max(4, round(length / (7.0 * wire)))
    u = np.linspace(0.0, 1.0, RINGS_PER_TURN * turns + 1)
    # The pitch vanishes over the first and the last turn, as in a spring with closed ends.
    pitch = np.clip(np.minimum(u, 1.0 - u) * turns - 0.4, 0.05, 0.6)
    advance = np.concatenate([[0.0], np.cumsum(0.5 * (pitch[1:] + pitch[:-1]))])
    x = wire + (length - 2.0 * wire) * advance / advance[-1]
    angle = 2.0 * np.pi * turns * u
    outward = np.stack([np.zeros_like(u), np.cos(angle), np.sin(angle)], axis=1)
    centre = radius * outward + np.stack([x, np.zeros_like(u), np.zeros_like(u)], axis=1)
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    binormal = np.cross(tangent, outward)

    corner = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.cos(corner)[:, None, None] * outward + np.sin(corner)[:, None, None] * binormal
    vertices = (centre + wire * ring).transpose(1, 0, 2).reshape(-1, 3)
    first = np.arange(len(u) - 1)[:, None] * SIDES + np.arange(SIDES)
    beside = np.arange(len(u) - 1)[:, None] * SIDES + (np.arange(SIDES) + 1) % SIDES
    side_1 = np.stack([first, beside, first + SIDES], axis=-1)
    side_2 = np.stack([beside, beside + SIDES, first + SIDES], axis=-1)
    fan = np.arange(1, SIDES - 1)
    last = SIDES * (len(u) - 1)
    caps = np.concatenate(
        [
            np.stack([np.zeros_like(fan), fan + 1, fan], axis=1),
            np.stack([np.full_like(fan, last), last + fan, last + fan + 1], axis=1),
        ]
    )
    faces = np.concatenate([side_1.reshape(-1, 3), side_2.reshape(-1, 3), caps]).astype(np.int32)
    return vertices, faces, np.repeat(advance / advance[-1], SIDES)


def _rotation_from_x(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    # Any frame whose first axis is the spring's will do: the coil has no up.
    x = direction / np.linalg.norm(direction)
    y = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [0.0, 1.0, 0.0], x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def skin_bytes(model: mujoco.MjModel, name: str) -> bytes:
    """The skin file of one spring, for a model at rest.

    Args:
        model: The rig; its skins are not looked at.
        name: Name of the spring, whose ends are the sites `NAME_start` and `NAME_end`.

    Returns:
        The content of a `.skn` file.

    Raises:
        KeyError: One of the two sites is missing.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ends = [model.site(f"{name}_start").id, model.site(f"{name}_end").id]
    start, stop = data.site_xpos[ends]
    radius, wire, _ = map(float, model.site_size[ends[0]])
    vertices, faces, place = coil(float(np.linalg.norm(stop - start)), radius, wire)
    vertices = start + vertices @ _rotation_from_x(stop - start).T

    bodies = list(dict.fromkeys(int(model.site_bodyid[i]) for i in ends))
    weights = [np.ones(len(place))] if len(bodies) == 1 else [1.0 - place, place]
    chunks = [
        struct.pack("<4i", len(vertices), 0, len(faces), len(bodies)),
        vertices.astype("<f4").tobytes(),
        faces.astype("<i4").tobytes(),
    ]
    for body, weight in zip(bodies, weights, strict=True):
        used = np.flatnonzero(weight > 0.0)
        chunks += [
            model.body(body).name.encode().ljust(BODY_NAME_BYTES, b"\0"),
            np.concatenate([data.xpos[body], data.xquat[body]]).astype("<f4").tobytes(),
            struct.pack("<i", len(used)),
            used.astype("<i4").tobytes(),
            weight[used].astype("<f4").tobytes(),
        ]
    return b"".join(chunks)


def springs(path: Path) -> dict[str, bytes]:
    """All springs of a model as file name and content.

    Args:
        path: MJCF file; its skin files need not exist yet.

    Returns:
        File name to content, one entry a skin.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    files = {skin.name: skin.file for skin in spec.skins}
    for skin in list(spec.skins):
        spec.delete(skin)
    model = spec.compile()
    return {file: skin_bytes(model, name) for name, file in files.items()}


def main(args: Args) -> None:
    """Write all spring files and print what was written."""
    for path in sorted(args.models.glob("*.xml")):
        for file, content in springs(path).items():
            target = args.models / "assets" / file
            write_bytes(target, content)
            print(f"{target}  {len(content) / 1000:.0f} kB")


if __name__ == "__main__":
    main(tyro.cli(Args))
