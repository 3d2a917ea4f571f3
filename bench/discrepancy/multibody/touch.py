"""Where the end of a tree of bodies is along a motion: its lowest point, which touches a surface first, and how every joint moves it.

A level surface is a table, the floor, a bench. With the joints where they were measured, a joint that errs by a small angle moves the
point by its lever times that angle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.multibody.model import ArticulatedModel, body_index
from bench.rig.shapes import lowest_point, shapes_of, upwards


class Touch(NamedTuple):
    """The lowest point of a body along a motion.

    Attributes:
        height: (n,) above the origin, against gravity [m].
        rising: (n, n_moving) by how much it rises with every joint [m/rad, or 1].
    """

    height: Array
    rising: Array


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
    up, i = upwards(model.model), body_index(model.model, body)
    assert up is not None
    found = lowest_point(model.model, i, shapes_of(model.model, i), model.whole(position, 0), up)
    return Touch(found.height, found.raised @ model.whole(np.eye(len(model.moving)), 1).T)
