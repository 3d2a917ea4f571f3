"""The structure of every rig a diagnosis knows: an oscillator, two bodies and a joint, a damper, the user's own MJCF."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.single_axis import MOTIONS, load_channel, motion_channels, turns
from bench.discrepancy.model.declared_elements import with_elements
from bench.discrepancy.model.mjcf import mjcf_structure
from bench.discrepancy.model.nominal_forces import NominalFriction
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings
from bench.errors import FileFormatError


def structure_of(case: Case, *, settings: DiagnosisSettings = DEFAULT) -> Structure:
    """Build the structure that a case names.

    Raises:
        FileFormatError: The rig is unknown, or a parameter or channel is missing.
    """
    bench = {"sdof": _sdof, "joint": _joint, "damper": _damper}
    if case.rig in bench:
        return with_elements(bench[case.rig](case), case)
    if case.rig.endswith(".xml"):
        return with_elements(mjcf_structure(case, settings=settings), case)
    raise FileFormatError(
        f"rig '{case.rig}' is unknown; known: sdof, joint, damper, or the path of an MJCF file (ending in .xml)"
    )


def _require(case: Case, parameters: Sequence[str], loads: Sequence[str]) -> None:
    have = {p.name for p in case.parameters}
    missing = [name for name in parameters if name not in have]
    if missing:
        raise FileFormatError(
            f"case '{case.name}' (rig {case.rig}) lacks the nominal parameter(s) {', '.join(missing)}; "
            f"it has {', '.join(sorted(have)) or 'none'}"
        )
    absent = [name for name in loads if not case.has(name)]
    if absent:
        raise FileFormatError(f"case '{case.name}' (rig {case.rig}) lacks the channel(s) {', '.join(absent)}")


def _observers(case: Case, table: Sequence[tuple[str, int, NDArray[np.float64]]]) -> tuple[Observer, ...]:
    found = tuple(Observer(name, order, row) for name, order, row in table if case.has(name))
    if not found:
        raise FileFormatError(
            f"case '{case.name}' has no response channel; expected one of {', '.join(name for name, _, _ in table)}"
        )
    return found


def _sdof(case: Case) -> Structure:
    names = ("mass", "damping", "stiffness", "coulomb")
    load, motion = load_channel(case), motion_channels(case)
    if not case.has(load) and all(c.role == "response" for c in case.channels):
        raise FileFormatError(
            f"case '{case.name}' has responses alone ({', '.join(c.name for c in case.channels)}): without what drove them nothing can be "
            f'said of the model. Record the {load}; or, for a free decay, say that it "starts_in_motion"'
        )
    _require(case, ("mass",), (load,))
    have = tuple(name for name in names if any(p.name == name for p in case.parameters))
    frictions = (NominalFriction(np.ones(1), "coulomb"),) if "coulomb" in have else ()
    stacks = [np.array([[[1.0 if name == kind else 0.0]] for name in have]) for kind in names[:3]]
    one = np.ones(1)
    observers = _observers(case, tuple((motion.get(i, names[0]), i, one) for i, names in enumerate(MOTIONS)))
    place = Place(
        "", np.ones((1, 1)), *_units(case), ("mass",),
        "stiffness" if "stiffness" in have else "", "damping" if "damping" in have else "", "carriage",
    )  # fmt: skip
    return Structure(
        ("x",),
        have,
        stacks[0],
        stacks[1],
        stacks[2],
        np.ones((1, 1)),
        (load,),
        observers,
        (place,),
        frictions=frictions,
    )


def _units(case: Case) -> tuple[str, str]:
    """Units of the position and of the force along the coordinate of a rig that has one."""
    position, load = motion_channels(case).get(0, ""), load_channel(case)
    length, force = ("rad", "N m") if turns(case) else ("m", "N")
    own = case.channel(position).unit if position else ""
    return own or length, case.channel(load).unit or force


def _damper(case: Case) -> Structure:
    """A massless component under prescribed motion; the mass only carries the bookkeeping of the coordinate."""
    load, position = load_channel(case), motion_channels(case).get(0, MOTIONS[0][0])
    _require(case, (), (position, load))
    names = tuple(p.name for p in case.parameters if p.name in {"stiffness", "damping", "coulomb"})
    stacks = [
        np.zeros((len(names), 1, 1)),
        *(
            np.array([float(name == kind) for name in names]).reshape(-1, 1, 1)
            for kind in ("damping", "stiffness")
        ),
    ]
    place = Place(
        "", np.ones((1, 1)), *_units(case), (),
        "stiffness" if "stiffness" in names else "", "damping" if "damping" in names else "", "piston",
    )  # fmt: skip
    return Structure(
        ("x",),
        names,
        stacks[0],
        stacks[1],
        stacks[2],
        np.ones((1, 1)),
        (position,),
        (Observer(load, 0, np.ones(1)),),
        (place,),
        frictions=(NominalFriction(np.ones(1), "coulomb"),) if "coulomb" in names else (),
    )


def _joint(case: Case) -> Structure:
    axes = (("axial", "mass", "m", "N"), ("torsional", "inertia", "rad", "N m"))
    names = [p.name for p in case.parameters]
    stacks = {kind: np.zeros((len(names), 4, 4)) for kind in ("mass", "damping", "stiffness")}
    places = []
    for a, (axis, inertia, position, force) in enumerate(axes):
        ground = [f"mount_{kind}_{axis}_{body}" for kind in ("stiffness", "damping") for body in (1, 2)]
        _require(
            case,
            [f"{inertia}_1", f"{inertia}_2", *ground, f"joint_stiffness_{axis}", f"joint_damping_{axis}"],
            (),
        )
        relative = np.zeros(4)
        relative[2 * a : 2 * a + 2] = (-1.0, 1.0)
        for body in (1, 2):
            i = 2 * a + body - 1
            stacks["mass"][names.index(f"{inertia}_{body}"), i, i] = 1.0
            for kind in ("stiffness", "damping"):
                stacks[kind][names.index(f"mount_{kind}_{axis}_{body}"), i, i] = 1.0
        for kind in ("stiffness", "damping"):
            stacks[kind][names.index(f"joint_{kind}_{axis}")] = np.outer(relative, relative)
        places.append(
            Place(
                axis,
                relative[None, :],
                position,
                force,
                (f"{inertia}_1", f"{inertia}_2"),
                f"joint_stiffness_{axis}",
                f"joint_damping_{axis}",
            )
        )
    places.append(Place("joint", np.vstack([p.rows for p in places]), "m", "N"))
    eye = np.eye(4)
    table = []
    for a, (linear, angular) in enumerate(
        (
            ("displacement", "rotation"),
            ("velocity", "angular_velocity"),
            ("acceleration", "angular_acceleration"),
        )
    ):
        for body in (1, 2):
            table += [(f"{linear}_{body}", a, eye[body - 1]), (f"{angular}_{body}", a, eye[body + 1])]
    loads = tuple(name for name in ("force", "torque") if case.has(name))
    if not loads:
        raise FileFormatError(f"case '{case.name}' has neither a force nor a torque channel")
    inputs = np.zeros((4, len(loads)))
    for j, name in enumerate(loads):
        inputs[0 if name == "force" else 2, j] = 1.0
    return Structure(
        ("x1", "x2", "theta1", "theta2"), tuple(names), stacks["mass"], stacks["damping"], stacks["stiffness"],
        inputs, loads, _observers(case, table), tuple(places),
    )  # fmt: skip
