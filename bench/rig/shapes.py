"""Shapes of bodies: their lowest points along a motion, which touch a level surface first.

The lowest point of a convex shape is where its support function against the vertical is taken; meshes count by their hull, as in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from bench.arrays import Array
from bench.native.poses import poses_along

SHAPES = {
    int(kind): kind
    for kind in (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_MESH,
    )
}
"""Shapes of geoms that have a lowest point."""


class LowestPoint(NamedTuple):
    """The lowest point of a body along a motion.

    Attributes:
        height: (n,) above the origin, along a direction [m].
        raised: (n, n_dofs) by how much every degree of freedom raises it [m/rad, or 1].
    """

    height: Array
    raised: Array


def upwards(model: mujoco.MjModel) -> Array | None:
    """Unit vector (3,) against gravity; None where there is none."""
    gravity = np.array(model.opt.gravity)
    size = float(np.linalg.norm(gravity))
    return None if size == 0.0 else -gravity / size


def shapes_of(model: mujoco.MjModel, body: int) -> list[int]:
    """Geoms of a body and of what is rigidly attached to it, as far as they have a lowest point."""
    weld = int(model.body_weldid[body])
    return [
        g
        for g in range(model.ngeom)
        if int(model.geom_type[g]) in SHAPES and int(model.body_weldid[model.geom_bodyid[g]]) == weld
    ]


def lowest_point(model: mujoco.MjModel, body: int, shapes: Sequence[int], q: Array, up: Array) -> LowestPoint:
    """The lowest point of geoms that are fixed to a body, against a direction (3,), along positions (n, n_dofs) of hinges and slides."""
    poses = poses_along(model, body, shapes, q)
    placed = zip(shapes, np.moveaxis(poses.position, 1, 0), np.moveaxis(poses.turn, 1, 0), strict=True)
    points = np.stack([_lowest(model, g, position, turn, up) for g, position, turn in placed], axis=1)
    heights = points @ up
    lowest, every = heights.argmin(axis=1), np.arange(len(q))
    return LowestPoint(heights[every, lowest], poses.raised(points[every, lowest], up))


def _lowest(model: mujoco.MjModel, geom: int, position: Array, turn: Array, up: Array) -> Array:
    """The lowest points (n, 3) of a geom at positions (n, 3) and orientations (n, 3, 3), by its support function against `up`."""
    size, down = model.geom_size[geom], -(up @ turn)
    kind = SHAPES[int(model.geom_type[geom])]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        vertices = model.mesh_vert[first : first + count].astype(np.float64)
        point = _farthest(vertices, down)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        point = np.copysign(size, down)
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        point = size**2 * down / np.linalg.norm(size * down, axis=1, keepdims=True)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        across = down[:, :2] / np.maximum(np.linalg.norm(down[:, :2], axis=1, keepdims=True), 1e-12)
        point = np.column_stack([size[0] * across, np.copysign(size[1], down[:, 2])])
    else:
        half = size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
        point = size[0] * down
        point[:, 2] += np.copysign(half, down[:, 2])
    return np.asarray(position + np.einsum("nij,nj->ni", turn, point))


def _farthest(vertices: Array, down: Array) -> Array:
    """The vertices (n, 3) that lie farthest along directions (n, 3), those of the hull, which are few; joggled, a sheet has one."""
    corners = vertices[ConvexHull(vertices, qhull_options="QJ").vertices]
    return np.asarray(corners[np.argmax(down @ corners.T, axis=1)])
