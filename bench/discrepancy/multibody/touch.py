"""Where the end of a tree of bodies is along a motion: its lowest point, which touches a surface first, and how every joint moves it.

A level surface is a table, the floor, a bench. The lowest point is that of the geoms of a body and of what is rigidly attached to it; of a
hull it is where its support function is taken. With the joints where they were measured, a joint that errs by a small angle moves the
point by its lever times that angle.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from bench.arrays import Array
from bench.discrepancy.multibody.model import ArticulatedModel, body_index
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


class Touch(NamedTuple):
    """The lowest point of a body along a motion.

    Attributes:
        height: (n,) above the origin, against gravity [m].
        rising: (n, n_moving) by how much it rises with every joint [m/rad, or 1].
    """

    height: Array
    rising: Array


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


def ends_of(model: ArticulatedModel) -> tuple[str, ...]:
    """Bodies that may touch a level surface: those that carry no other moving body and have a shape, where there is gravity."""
    mj = model.model
    if upwards(mj) is None:
        return ()
    carrying = {int(mj.body_weldid[mj.body_parentid[i]]) for i in range(1, mj.nbody) if mj.body_dofnum[i] > 0}
    bodies = [(name, body_index(mj, name)) for name in model.bodies]
    return tuple(name for name, i in bodies if i not in carrying and shapes_of(mj, i))


def touch_of(model: ArticulatedModel, body: str, position: Array) -> Touch:
    """The lowest point of a body along positions (n, n_moving)."""
    mj, up = model.model, upwards(model.model)
    assert up is not None
    i = body_index(mj, body)
    shapes = shapes_of(mj, i)
    poses = poses_along(mj, i, shapes, model.whole(position, 0))
    points = np.stack(
        [_lowest(mj, g, poses.position[:, k], poses.turn[:, k], up) for k, g in enumerate(shapes)], axis=1
    )
    heights = points @ up
    lowest, every = heights.argmin(axis=1), np.arange(len(position))
    raised = poses.raised(points[every, lowest], up)
    return Touch(heights[every, lowest], raised @ model.whole(np.eye(len(model.moving)), 1).T)


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
