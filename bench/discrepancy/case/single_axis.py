"""Names of the channels of a rig with one coordinate, which slides or turns."""

from __future__ import annotations

from bench.discrepancy.case.case import Case

MOTIONS = (
    ("displacement", "rotation", "angle"),
    ("velocity", "angular_velocity"),
    ("acceleration", "angular_acceleration"),
)
"""Position, velocity and acceleration: the names that they may have."""
LOADS = ("force", "torque")
"""The load, or the force of a component whose motion is prescribed."""


def motion_channels(case: Case) -> dict[int, str]:
    """Channels that measure the motion, by the derivative that each measures."""
    found = {}
    for order, names in enumerate(MOTIONS):
        have = next((name for name in names if case.has(name)), "")
        if have:
            found[order] = have
    return found


def load_channel(case: Case) -> str:
    """The channel of the load; "force" where there is none, for a message that asks for it."""
    return next((name for name in LOADS if case.has(name)), LOADS[0])


def turns(case: Case) -> bool:
    """Whether the coordinate turns, by the names of its channels."""
    names = {*motion_channels(case).values(), load_channel(case)}
    return bool(names & {name for names_of in (*MOTIONS, LOADS) for name in names_of[1:]})
