"""Damper tests as recordings in metres and kilonewtons, for figures."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import NDArray

from bench.identification.damper_study import DamperRecord
from bench.recording import Recording


def damper_recording(record: DamperRecord, force: NDArray | None = None) -> Recording:
    """Motion and force of a test.

    Args:
        record: The test.
        force: Force in the place of the measured one (n,) [N], as a model's.
    """
    arrays = {
        "displacement": record.displacement,
        "velocity": record.velocity,
        "force": 1e-3 * (record.force if force is None else force),
    }
    return Recording.from_arrays(
        record.time - record.time[0], arrays, units={"displacement": "m", "velocity": "m/s", "force": "kN"}
    )


def beside(record: DamperRecord, forces: Mapping[str, NDArray]) -> dict[str, Recording]:
    """The measured record and those with the forces of models on the same motion, by name."""
    return {"measured": damper_recording(record)} | {
        name: damper_recording(record, force) for name, force in forces.items()
    }


LOOPS = [("displacement", "force"), ("velocity", "force")]
"""Force over displacement and over velocity."""
