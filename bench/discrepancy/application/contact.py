"""A level surface in MuJoCo's own terms: a plane, and a contact pair with every shape of the body that touches it."""

from __future__ import annotations

import mujoco
import numpy as np

from bench.discrepancy.application.forces import values_of
from bench.discrepancy.application.target import PREFIX, TARGET_SETTINGS, Change, Target
from bench.discrepancy.verdict import NamedEffect
from bench.rig.shapes import SHAPES, upwards


def surface_contact(target: Target, effect: NamedEffect) -> Change:
    """A plane that pushes as a spring with a damper against every shape of a body, exactly as a limit does, see `Target.stop`.

    The inverse inertia by which MuJoCo weighs a contact is the body's at the reference position, wherever it is.
    """
    v, body = values_of(effect), target.body(effect.where)
    up = upwards(target.nominal)
    if up is None or target.spec.option.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        text = "the model has its contacts switched off, or no gravity; put a plane there by hand"
        return Change(effect.name, effect.where, "none", text)
    turn = np.zeros(4)
    mujoco.mju_quatZ2Vec(turn, up)
    plane = target.spec.worldbody.add_geom(
        name=f"{PREFIX}{effect.where}_surface", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(1.0, 1.0, 0.01), pos=v["height"] * up, quat=turn,
        contype=0, conaffinity=0, rgba=(0.6, 0.6, 0.6, 0.5),
    )  # fmt: skip
    shapes = [g for g in _shapes(body) if int(g.type) in SHAPES]
    pairs, impedance = [], TARGET_SETTINGS.spring_impedance
    for number, shape in enumerate(shapes):
        shape.name = shape.name or f"{PREFIX}{effect.where}_{number}"
        pair = target.spec.add_pair(
            name=f"{PREFIX}{shape.name}_on_surface", geomname1=plane.name, geomname2=shape.name
        )
        pair.condim, pair.margin, pair.gap = 1, 0.0, 0.0
        pair.solimp = (impedance, impedance, 0.001, 0.5, 2.0)
        pairs.append(pair)

    def stiffen(model: mujoco.MjModel) -> None:
        for pair in pairs:
            weight = float(model.body_invweight0[model.geom(pair.geomname2).bodyid[0], 0])
            pair.solref = (-v["stiffness"] * weight, -v["damping"] * weight)

    target.later.append(stiffen)
    text = (
        f"a plane at a height of {v['height']:.6g} m that pushes on '{effect.where}' as a spring of "
        f"{v['stiffness']:.6g} N/m and a damper of {v['damping']:.6g} N s/m"
    )
    return Change(effect.name, effect.where, "native", text, (("body", effect.where), ("geom", plane.name)))


def _shapes(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    """Geoms of a body and of those that are fixed to it."""
    fixed = [child for child in body.bodies if not child.joints]
    return [*body.geoms, *(shape for child in fixed for shape in _shapes(child))]
