"""Motions and restoring forces of a joint out of records: by the channels of an element, or by named columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.errors import IdentificationError, ParameterError, UnknownNameError
from bench.identification.parametric import ComponentRecord
from bench.identification.restoring_force import Body, joint_data
from bench.recording import Recording

MOTIONS = ("displacement", "rotation", "angle")
FORCES = ("force", "torque")


@dataclass(frozen=True)
class JointColumns:
    """Which channels say what of a joint; one entry a coordinate.

    Attributes:
        displacement: Relative displacements; empty to find them.
        velocity: Relative velocities; empty to differentiate the displacements.
        force: Restoring forces, positive when they oppose a positive displacement; empty where they follow from the next four.
        applied: Forces applied to the body.
        acceleration: Absolute accelerations of the body.
        mass: Its masses or inertias.
        element: Element of a simulated record whose channels are taken.
        body: Which body of the joint the applied forces act on.
    """

    displacement: tuple[str, ...] = ()
    velocity: tuple[str, ...] = ()
    force: tuple[str, ...] = ()
    applied: tuple[str, ...] = ()
    acceleration: tuple[str, ...] = ()
    mass: tuple[float, ...] = ()
    element: str = ""
    body: Body = "second"


def joint_motions(
    records: Sequence[Recording], columns: JointColumns
) -> tuple[list[ComponentRecord], JointColumns]:
    """Motions and restoring forces of a joint, one of each record, and the channels they were taken from.

    Args:
        records: Records; settling times are left out. Values are brought to SI.
        columns: What is what.

    Raises:
        UnknownNameError: A record has no such channel or element.
        IdentificationError: It cannot be found what is what.
        ParameterError: Names do not go together.
    """
    if not records:
        raise IdentificationError("no records came; at least one record of a joint is expected")
    inside = [record.to_si() for record in records]
    chosen = _chosen(inside[0], columns)
    return [_motion(record, chosen) for record in inside], chosen


def _chosen(record: Recording, columns: JointColumns) -> JointColumns:
    if columns.displacement and (columns.force or columns.applied):
        return _checked(columns)
    if columns.displacement or columns.force or columns.applied:
        raise ParameterError(
            "--displacement and --restoring-force (or --applied, --acceleration and --mass) go together; name both, or neither"
        )
    found = elements_of(record)
    if columns.element and columns.element not in found:
        raise UnknownNameError("element of the record", columns.element, found)
    if columns.element or len(found) == 1:
        name = columns.element or found[0]
        displacement, velocity, force = (
            tuple(channel for channel in record.names if channel.startswith(f"{name}/{kind}"))
            for kind in ("displacement", "velocity", "force")
        )
        return JointColumns(displacement, velocity, force, element=name)
    motions = [c.name for c in record.channels if c.quantity in MOTIONS]
    loads = [c.name for c in record.channels if c.quantity in FORCES and c.role != "command"]
    if len(motions) == len(loads) == 1:
        return JointColumns((motions[0],), (), (loads[0],))
    several = f"several elements ({', '.join(found)}): name one with --element"
    if len(found) < 2:
        several = (
            f"displacements {motions or 'none'} and forces {loads or 'none'}: name them with --displacement and --restoring-force, "
            "or with --applied, --acceleration and --mass"
        )
    raise IdentificationError(
        f"it does not say what is the joint's motion and force; the records have {several}"
    )


def elements_of(record: Recording) -> list[str]:
    """Elements whose motion and force a simulated record holds."""
    names = [name.rpartition("/")[0] for name in record.names if name.rpartition("/")[2].startswith("force")]
    return [name for name in dict.fromkeys(names) if name]


def _checked(columns: JointColumns) -> JointColumns:
    k = len(columns.displacement)
    given = {
        "--velocity": columns.velocity,
        "--restoring-force": columns.force,
        "--applied": columns.applied,
        "--acceleration": columns.acceleration,
    }
    for name, entries in given.items():
        if entries and len(entries) != k:
            raise ParameterError(f"{name} names {len(entries)} channel(s), --displacement {k}; one a coordinate is expected")  # fmt: skip
    if columns.force and columns.applied:
        raise ParameterError(
            "--restoring-force and --applied came; a restoring force is measured or follows, not both"
        )
    if columns.applied and not (columns.acceleration and len(columns.mass) in (1, k)):
        raise ParameterError(
            "--applied needs --acceleration, one a coordinate, and --mass: r = F - m a is what they give"
        )
    return columns


def _motion(record: Recording, columns: JointColumns) -> ComponentRecord:
    settled = record.scored
    x = np.stack([record[name] for name in columns.displacement], axis=1)
    if columns.velocity:
        v = np.stack([record[name] for name in columns.velocity], axis=1)
    else:
        v = np.gradient(x, 1.0 / record.sample_rate, axis=0)
    if columns.force:
        r = np.stack([record[name] for name in columns.force], axis=1)
    else:
        mass = columns.mass if len(columns.mass) > 1 else columns.mass * len(columns.applied)
        whole = record.with_(settle=0.0)
        r = joint_data(
            whole, displacements=columns.displacement, velocities=columns.velocity or columns.displacement,
            applied=columns.applied, accelerations=columns.acceleration, mass=mass, body=columns.body,
        ).forces  # fmt: skip
    return ComponentRecord(record.time[settled], x[settled], v[settled], r[settled])
