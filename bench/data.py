"""Measured records that come with the bench.

`friction_damper`: eight tests of a real banded rotary friction damper with backlash under prescribed sinusoidal motion,
from the ARTS-Laboratory's "Dataset-Friction-Damper-with-Backlash" (CC BY-SA 4.0; see ATTRIBUTION.md beside the files).
Two frequencies at each of four band tensions, so that a model can be identified on some and tried on others.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from bench.errors import UnknownNameError
from bench.record_files import read_recording
from bench.recording import Recording

FRICTION_DAMPER_FOLDER = Path(__file__).resolve().parent / "_data" / "friction_damper"
"""The excerpt's files, its licence and its attribution."""


@cache
def friction_damper_names() -> tuple[str, ...]:
    """Names of the friction damper's tests, by frequency and band tension: "0.5Hz_20lb", …, "1Hz_80lb"."""
    stems = [file.stem for file in FRICTION_DAMPER_FOLDER.glob("*.parquet")]
    return tuple(
        sorted(stems, key=lambda stem: tuple(float(part.rstrip("Hzlb")) for part in stem.split("_")))
    )


@cache
def friction_damper(name: str) -> Recording:
    """A test of the friction damper, in the units it was measured in.

    Channels: displacement [inch] (prescribed), force [kip], velocity [inch/s], tensioner_1 [lbf], tensioner_2 [lbf], at
    1024 Hz; six cycles of which the first two grow to full amplitude, the next three hold it and the last is smaller.
    The first cycle is left out of scores (settle): where in its backlash the damper stood at the start is not known. The
    force at rest is not zero (-0.06 to -0.2 kip, larger at higher tension) and is given as ``meta["force_at_rest_kip"]``,
    not removed: whether it is the sensor's offset or a force held by the band is not known either.

    Args:
        name: One of `friction_damper_names`.

    Raises:
        UnknownNameError: There is no such test.

    Example:
        >>> friction_damper("0.5Hz_35lb").to_si().channel("force").unit
        'N'
    """
    if name not in friction_damper_names():
        raise UnknownNameError("friction damper test", name, friction_damper_names())
    return read_recording(FRICTION_DAMPER_FOLDER / f"{name}.parquet")
