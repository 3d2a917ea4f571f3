"""Records of the SDOF rig in the dissertation's inch and pound-force, with the restoring force a laboratory computes."""

from __future__ import annotations

from bench.laws.coupling import INCH, POUND_FORCE
from bench.recording import Recording

STIFFNESS = POUND_FORCE / INCH
"""lbf/in in N/m; also lbf s/in in N s/m and lbf s^2/in in kg."""

UNITS = {"m": "in", "m/s": "in/s", "m/s^2": "in/s^2", "N": "lbf", "N m": "lbf in"}


def imperial(recording: Recording) -> Recording:
    """The record in inches and pounds-force; rotations and torques stay as they are."""
    return recording.to_units(
        {channel.name: UNITS[channel.unit] for channel in recording.channels if channel.unit in UNITS}
    )


def sdof_view(recording: Recording, mass: float) -> Recording:
    """Force, motion and restoring force ``r = F - m a`` of a record of the SDOF rig, in inches and pounds-force.

    Args:
        recording: A record of the rig.
        mass: Mass of the carriage [lbf s^2/in].

    Returns:
        Channels force, displacement, velocity, acceleration and restoring_force, and those of the elements.

    References:
        Tasbihgoo 2006, eq. 2.4.
    """
    record = imperial(recording)
    elements = [name for name in record.names if "/" in name]
    view = record.select(["load_cell", "displacement", "velocity", "acceleration_x", *elements]).renamed(
        {"load_cell": "force", "acceleration_x": "acceleration"}
    )
    return view.with_channels(
        {"restoring_force": view["force"] - mass * view["acceleration"]},
        units={"restoring_force": "lbf"},
        quantities={"restoring_force": "force"},
    )
