"""All cases of the fifth laboratory."""

from __future__ import annotations

from fifth_laboratory_cases.actuators import SCREW_AXIS, SPOOL
from fifth_laboratory_cases.beam import BEAM
from fifth_laboratory_cases.hydraulics import CYLINDER, STRUT
from fifth_laboratory_cases.mounts import AIRSEAT, MOUNT_WARM
from fifth_laboratory_cases.turning import COMPOUND_PENDULUM, DRIVE_LINE, ROTOR

CASES = (
    SPOOL,
    STRUT,
    AIRSEAT,
    SCREW_AXIS,
    DRIVE_LINE,
    MOUNT_WARM,
    ROTOR,
    CYLINDER,
    COMPOUND_PENDULUM,
    BEAM,
)
"""All of them, in the order of their author."""
