"""Couplings that leave fewer degrees of freedom than joints: linear equalities, and modes so stiff that no record could show them.

An ``<equality>`` between joints or fixed tendons that is linear (``polycoef`` with nothing beyond the first two) is a linear
constraint ``E q = 0``. A cable that is stiff against all else is one, too, as far as records can tell: of a mode far above the sample
rate there remains the constraint ``phi' M q = 0``. With ``q = T z`` the structure is ``T' M T``, and so on (Guyan 1965; Craig 1981,
section 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from scipy import linalg

from bench import native
from bench.arrays import Array
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.settings import ModelSettings
from bench.errors import BenchError, ModelError
from bench.rig import Rig
from bench.rig.building import parse

LINK = "coupling "
"""Beginning of the names of tendons that stand for equalities."""


def without_equalities(rig: Rig) -> tuple[Rig, list[dict[str, float]]]:
    """A rig whose linear equalities are taken out, and these: coefficients by joint or tendon, whose sum is zero.

    A soft tendon keeps together what they coupled; its stiffness is nothing in their constraint.

    Raises:
        ModelError: An equality has an offset.
    """
    model = parse(rig.mjcf, rig.folder, rig.name).compile()
    if not model.neq:
        return rig, []
    spec = parse(rig.mjcf, rig.folder, rig.name)
    links: list[dict[str, float]] = []
    for i, equality in reversed(list(enumerate(spec.equalities))):
        if not model.eq_active0[i]:
            spec.delete(equality)
            continue
        link = _link(model, i)
        if link is not None:
            links.append(link)
            spec.delete(equality)
    for i, link in enumerate(links):
        tendon = spec.add_tendon(name=f"{LINK}{i}", stiffness=1.0)
        for name, coefficient in _joints(model, link).items():
            tendon.wrap_joint(name, coefficient)
    return Rig(rig.name, spec.to_xml(), timestep=rig.timestep, folder=rig.folder), links


def _link(model: mujoco.MjModel, index: int) -> dict[str, float] | None:
    """A linear equality of joints or fixed tendons; None for others, which are refused where models are refused."""
    kind = int(model.eq_type[index])
    joints = kind == int(mujoco.mjtEq.mjEQ_JOINT)
    if not joints and kind != int(mujoco.mjtEq.mjEQ_TENDON):
        return None
    offset, slope, *bent = model.eq_data[index][:5]
    if np.any(bent):
        return None
    object_kind = mujoco.mjtObj.mjOBJ_JOINT if joints else mujoco.mjtObj.mjOBJ_TENDON
    first = mujoco.mj_id2name(model, object_kind, int(model.eq_obj1id[index]))
    other = int(model.eq_obj2id[index])
    second = mujoco.mj_id2name(model, object_kind, other) if other >= 0 else ""
    if offset:
        raise ModelError(
            f"an equality holds '{first}' at {offset:g} from its reference position; draw the bodies in the model as they are held"
        )
    try:
        for name in (first, second):
            if name:
                native.coordinate(model, name)
    except BenchError:
        return None
    return {first: 1.0, second: -float(slope)} if second else {first: 1.0}


def _joints(model: mujoco.MjModel, link: dict[str, float]) -> dict[str, float]:
    """Coefficients of a link by joint."""
    out: dict[str, float] = {}
    for name, coefficient in link.items():
        for _, dof, term in native.coordinate(model, name).terms:
            joint = model.joint(int(model.dof_jntid[dof])).name
            out[joint] = out.get(joint, 0.0) + coefficient * term
    return {name: value for name, value in out.items() if value}


def rows_of(model: mujoco.MjModel, links: Sequence[dict[str, float]], dofs: Sequence[str]) -> Array:
    """Constraints (n_links, n_dof) over the degrees of freedom kept."""
    rows = np.zeros((len(links), len(dofs)))
    for row, link in zip(rows, links, strict=True):
        for name, coefficient in _joints(model, link).items():
            row[list(dofs).index(name)] = coefficient
    return rows


def stiff_modes(structure: Structure, values: Array, step: float, *, settings: ModelSettings) -> Array:
    """Constraints (n, n_dof) that stand for modes which no record of such a step could show; none where all are so."""
    linear = structure.at(values)
    decomposed = linalg.eigh(0.5 * (linear.stiffness + linear.stiffness.T), linear.mass)
    squares, modes = np.asarray(decomposed[0]), np.asarray(decomposed[1])
    fast = squares * step**2 > settings.fast**2
    return np.zeros((0, len(squares))) if fast.all() else np.asarray(modes[:, fast].T @ linear.mass)


def constrained(structure: Structure, constraints: Array, dependent: Sequence[str] = ()) -> Structure:
    """A structure on the motions that constraints (n, n_dof) leave.

    Args:
        structure: Without them.
        constraints: Rows ``E`` of ``E q = 0``.
        dependent: Degrees of freedom to be eliminated first.
    """
    if not len(constraints):
        return structure
    n_dof = len(structure.dofs)
    # columns of the dependents first, then those with the largest part in a constraint
    favour = np.array([1e3 if name in dependent else 1.0 for name in structure.dofs])
    scaled = constraints / np.linalg.norm(constraints, axis=1)[:, None]
    # SciPy's types leave open how many arrays come
    order = np.asarray(tuple(linalg.qr(scaled * favour, pivoting=True))[-1], dtype=np.int64)
    gone = np.sort(order[: len(constraints)])
    kept = np.setdiff1d(np.arange(n_dof), gone)
    motion = np.zeros((n_dof, len(kept)))
    motion[kept] = np.eye(len(kept))
    motion[gone] = -np.linalg.solve(constraints[:, gone], constraints[:, kept])

    # of places that have become one and the same coordinate the one that is still a degree of freedom stays
    places: list[Place] = []
    for place in sorted(structure.places, key=lambda p: p.site not in {structure.dofs[i] for i in kept}):
        rows = place.rows @ motion
        moved = np.abs(rows).max() > 1e-6 * np.abs(place.rows).max()
        if moved and not any(_one(rows, other.rows) for other in places):
            places.append(replace(place, rows=rows))
    places.sort(key=lambda place: [p.name for p in structure.places].index(place.name))

    def square(stack: Array) -> Array:
        return np.asarray(motion.T @ stack @ motion)

    return replace(
        structure,
        dofs=tuple(structure.dofs[i] for i in kept),
        mass=square(structure.mass), damping=square(structure.damping), stiffness=square(structure.stiffness),
        inputs=motion.T @ structure.inputs,
        observers=tuple(replace(o, row=o.row @ motion) for o in structure.observers),
        places=tuple(places),
        fixed=None if structure.fixed is None else square(structure.fixed),
        frictions=tuple(replace(f, row=f.row @ motion) for f in structure.frictions),
        springs=tuple(replace(s, row=s.row @ motion) for s in structure.springs),
        prescribed=tuple(replace(o, row=o.row @ motion) for o in structure.prescribed),
    )  # fmt: skip


def _one(first: Array, second: Array) -> bool:
    """Whether two places (n, n_dof) are one coordinate, but for a factor."""
    if len(first) != 1 or len(second) != 1:
        return False
    along = abs(float(first[0] @ second[0]))
    return along > (1.0 - 1e-9) * float(np.linalg.norm(first) * np.linalg.norm(second))
