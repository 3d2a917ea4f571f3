"""A diagnosis in the rerun viewer: measured and both simulations, where they part, where the force is missing, its loops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import uniform_filter1d

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.localise import box
from bench.discrepancy.localisation.state_map import StateMap
from bench.discrepancy.prediction.validation_discrepancy import coordinates
from bench.discrepancy.report.articulated import write_articulated_rerun
from bench.discrepancy.report.simulated_records import MEASURED, place_channels, variants

if TYPE_CHECKING:
    from bench.discrepancy.diagnosis import Diagnosis
    from bench.rerun_log import Band


@dataclass(frozen=True)
class RerunRecordingSettings:
    """Numbers of `bench.discrepancy.report.rerun_recording`."""

    clear: float = 3.0
    """RMS error over half a cycle, in units of the noise, above which a simulation is said to miss the measurement."""
    smallest_gap: float = 0.02
    """The same as a part of the channel's standard deviation: a gap below it nobody would see."""


SETTINGS = RerunRecordingSettings()


def write_rerun(diagnosis: Diagnosis | ArticulatedDiagnosis, path: str | Path) -> None:
    """Write the first judging record of a diagnosis, measured and simulated, as a ``.rrd`` file.

    Args:
        diagnosis: The diagnosis.
        path: The file, written whole or not at all.

    Raises:
        OutputError: The file cannot be written.
    """
    from bench.rerun_log import log_comparison  # noqa: PLC0415  (rerun, for pictures only)

    if isinstance(diagnosis, ArticulatedDiagnosis):
        write_articulated_rerun(diagnosis, path)
        return
    runs = variants(diagnosis)
    loops = []
    for found in diagnosis.where.maps:
        x, v, f = place_channels(found.place.name)
        loops += [(x, f), (v, f)]
    log_comparison(
        path, {}, runs, loops=loops, bands=[*_gap_bands(diagnosis, runs), *_region_bands(diagnosis)],
        title=f"diagnosis of {diagnosis.case.name}: {diagnosis.verdict.explanation}",
    )  # fmt: skip


def _gap_bands(diagnosis: Diagnosis, runs) -> list[Band]:
    """Where each simulation misses each judged channel."""
    from bench.rerun_log import GAP, Band  # noqa: PLC0415

    problem = diagnosis.problem
    measured = runs[MEASURED]
    others = tuple(label for label in runs if label != MEASURED)
    out = []
    for _, names in coordinates(problem.structure):
        for name, _ in names:
            y = measured[name]
            noise = float(problem.noise[problem.structure.channels.index(name)])
            limit = max(SETTINGS.clear * noise, SETTINGS.smallest_gap * float(np.std(y)))
            out.append(Band(f"gap_in_{name}", GAP, (name,), _misses(y, limit), others))
    return out


def _misses(measured: Array, limit: float) -> Callable[[Array], np.ndarray]:
    crossings = max(int(np.count_nonzero(np.diff(np.signbit(measured - measured.mean())))), 1)
    width = max(len(measured) // crossings, 1)
    return lambda y: (np.sqrt(uniform_filter1d((y - measured) ** 2, width)) > limit).astype(np.int64)


def _region_bands(diagnosis: Diagnosis) -> list[Band]:
    """Where the measured motion is in a region of the missing force."""
    from bench.rerun_log import REGION, Band  # noqa: PLC0415

    out = []
    for found in diagnosis.where.maps:
        if not found.regions:
            continue
        x, v, _ = place_channels(found.place.name)
        name = f"missing_force_region{f'_{found.place.name}' if found.place.name else ''}"
        out.append(Band(name, REGION, (x, v), _inside(found), (MEASURED,)))
    return out


def _inside(found: StateMap) -> Callable[[Array, Array], np.ndarray]:
    def classify(x: Array, v: Array) -> np.ndarray:
        out = np.zeros(len(x), dtype=np.int64)
        for region in reversed(found.regions):
            inside = np.ones(len(x), dtype=bool)
            for samples, limits in ((x, box(region).get("displacement")), (v, box(region).get("velocity"))):
                if limits is not None:
                    inside &= (samples >= limits[0]) & (samples <= limits[1])
            out[inside] = 2 if region.force > 0.0 else 1
        return out

    return classify
