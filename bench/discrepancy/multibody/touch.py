"""Where the end of a tree of bodies is along a motion: its lowest point, which touches a surface first, and how every joint moves it.

A level surface is a table, the floor, a bench. With the joints where they were measured, a joint that errs by a small angle moves the
point by its lever times that angle.
"""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.multibody.model import ArticulatedModel, body_index
from bench.discrepancy.multibody.motion import JointClock, JointMotion
from bench.rig.shapes import LowestPoint, lowest_point, shapes_of, upwards


def ends_of(model: ArticulatedModel) -> tuple[str, ...]:
    """Bodies that may touch a level surface: those that carry no other moving body and have a shape, where there is gravity."""
    mj = model.model
    if upwards(mj) is None:
        return ()
    carrying = {int(mj.body_weldid[mj.body_parentid[i]]) for i in range(1, mj.nbody) if mj.body_dofnum[i] > 0}
    bodies = [(name, body_index(mj, name)) for name in model.bodies]
    ends = ((name, i) for name, i in bodies if mj.body_dofnum[i] > 0 and i not in carrying)
    return tuple(name for name, i in ends if shapes_of(mj, i))


def touch_of(model: ArticulatedModel, body: str, position: Array) -> LowestPoint:
    """The lowest point of a body along positions (n, n_moving), raised by the joints (n, n_moving) with all that they move."""
    up, i = upwards(model.model), body_index(model.model, body)
    assert up is not None
    found = lowest_point(model.model, i, shapes_of(model.model, i), model.whole(position, 0), up)
    return found._replace(raised=found.raised @ model.whole(np.eye(len(model.moving)), 1).T)


def touches_along(model: ArticulatedModel, motion: JointMotion, clock: JointClock) -> list[dict[str, Array]]:
    """For every joint the ends of the tree by name, each with its lowest point (3, n_steps), see `JointRecord.touches`."""
    out: list[dict[str, Array]] = [{} for _ in model.joints]
    for body in ends_of(model):
        point = touch_of(model, body, motion.position)
        height, raised = clock.between(point.height[:, None])[0], clock.between(point.raised)
        rates = clock.between(point.raised * motion.velocity)
        for j, own in enumerate(out):
            own[body] = np.stack([height, raised[j], rates.sum(axis=0) - rates[j]])
    return out
