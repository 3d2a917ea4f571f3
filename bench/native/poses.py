"""Where MuJoCo puts geoms along a motion, and how every joint moves what is there, in one compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numba
import numpy as np

from bench.arrays import Array
from bench.native import quiet, untimed
from bench.native.inverse import address, call


class Poses(NamedTuple):
    """Geoms along a motion, and the motion of their body.

    Attributes:
        position: (n, n_geoms, 3) of the geoms' centres [m].
        turn: (n, n_geoms, 3, 3) from their frames to the world.
        axes: (n, n_dofs, 6) turning and sliding of the world about `centre` by every degree of freedom; zero of those that do not move the
            body.
        centre: (n, 3) about which.
    """

    position: Array
    turn: Array
    axes: Array
    centre: Array

    def raised(self, points: Array, up: Array) -> Array:
        """How every degree of freedom raises points (n, 3) of the body along a direction (3,): (n, n_dofs)."""
        turned = np.cross(self.axes[:, :, :3], (points - self.centre)[:, None, :])
        return np.asarray((self.axes[:, :, 3:] + turned) @ up)


@numba.njit(cache=True, nogil=True)
def _along(functions, model, data, q, qpos, found, geoms, root, position, turn, axes, centre):
    geom_position, geom_turn, dofs, middle = found
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            qpos[j] = q[k, j]
        for i in range(functions.shape[0]):
            call(functions[i], model, data)
        for g in range(geoms.shape[0]):
            for i in range(3):
                position[k, g, i] = geom_position[geoms[g], i]
            for i in range(9):
                turn[k, g, i] = geom_turn[geoms[g], i]
        for j in range(axes.shape[1]):
            for i in range(6):
                axes[k, j, i] = dofs[j, i]
        for i in range(3):
            centre[k, i] = middle[root, i]


@quiet()
@untimed()
def poses_along(model: mujoco.MjModel, body: int, geoms: Sequence[int], q: Array) -> Poses:
    """Geoms that are fixed to a body, along positions (n, n_dofs) of a model of hinges and slides."""
    data, n = mujoco.MjData(model), len(q)
    out = (
        np.empty((n, len(geoms), 3)),
        np.empty((n, len(geoms), 9)),
        np.empty((n, model.nv, 6)),
        np.empty((n, 3)),
    )
    _along(
        np.array([address(name) for name in ("mj_kinematics", "mj_comPos")], dtype=np.int64), model._address, data._address,
        np.ascontiguousarray(q, dtype=np.float64), data.qpos, (data.geom_xpos, data.geom_xmat, data.cdof, data.subtree_com),
        np.array(geoms, dtype=np.int64), int(model.body_rootid[body]), *out,
    )  # fmt: skip
    position, turn, axes, centre = out
    carriers, at = set(), body
    while at:
        carriers.add(at)
        at = int(model.body_parentid[at])
    axes[:, [j for j in range(model.nv) if int(model.dof_bodyid[j]) not in carriers]] = 0.0
    return Poses(position, turn.reshape(n, len(geoms), 3, 3), axes, centre)
