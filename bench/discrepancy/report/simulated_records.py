"""A judging record beside its simulations before and after, with the missing force of each: what pictures are made of.

The missing force of a simulation is estimated by the same observer as that of the measurement, from the simulated channels. So
the nominal model shows none, the model with the effect shows the effect, and both have gone through the same smoothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.force_smoother import observers
from bench.discrepancy.localisation.localise import known_parameters
from bench.discrepancy.prediction.validation_discrepancy import coordinates, nominal_prediction
from bench.recording import Recording

if TYPE_CHECKING:
    from bench.discrepancy.diagnosis import Diagnosis

MEASURED, NOMINAL, APPLIED = "measured", "nominal model", "in your simulator"


def final_label(diagnosis: Diagnosis) -> str:
    """What the last simulation is called."""
    kind = diagnosis.verdict.verdict
    return {"unknown": "with the closure", "none": "parameters re-estimated"}.get(kind, "with the effect")


def variants(diagnosis: Diagnosis, record: CaseRecord | None = None) -> dict[str, Recording]:
    """Measured, nominal and final responses of a record; simulations that diverged are left out.

    Args:
        diagnosis: The diagnosis.
        record: The record; the first judging one where None.

    Returns:
        Recordings by label, the measured one first. Beside the channels of the case they hold for every place with one
        coordinate ``displacement``, ``velocity`` and ``missing force``, followed by the name of the place.
    """
    chosen = diagnosis.case.validation[0] if record is None else record
    units = {c.name: c.unit or "1" for c in diagnosis.case.channels}
    roles = {c.name: {"command": "command"}.get(c.role, "measured") for c in diagnosis.case.channels}
    runs: dict[str, Mapping[str, Array]] = {
        MEASURED: dict(chosen.values),
        NOMINAL: nominal_prediction(diagnosis.problem)(chosen),
        final_label(diagnosis): diagnosis.final.predict(chosen),
    }
    out = {}
    for label, values in runs.items():
        if not all(np.isfinite(v).all() for v in values.values()):
            continue
        whole = {**chosen.values, **values}
        forces, force_units = _forces(diagnosis, chosen, whole)
        shown = {name: whole[name] for name in (whole if label == MEASURED else values)} | forces
        out[label] = Recording.from_arrays(
            chosen.time - chosen.start,
            shown,
            units={name: {**units, **force_units}[name] for name in shown},
            roles={name: role for name, role in roles.items() if name in shown},
        )
    return out


def judged(diagnosis: Diagnosis, runs: Mapping[str, Recording]) -> dict[str, Recording]:
    """The judged coordinates of runs of `variants`: channels, or the difference of two; one without a name has that of its channel."""
    units = {c.name: c.unit or "1" for c in diagnosis.case.channels}
    found = [(name or parts[0][0], parts) for name, parts in coordinates(diagnosis.problem.structure)]
    return {
        label: Recording.from_arrays(
            run.time,
            {name: np.sum([sign * run[c] for c, sign in channels], axis=0) for name, channels in found},
            units={name: units[channels[0][0]] for name, channels in found},
        )
        for label, run in runs.items()
    }


def place_channels(place: str) -> tuple[str, str, str]:
    """Names of displacement, velocity and missing force of a place in the recordings of `variants`."""
    suffix = f" {place}" if place else ""
    return f"relative displacement{suffix}", f"relative velocity{suffix}", f"missing force{suffix}"


def _forces(
    diagnosis: Diagnosis, record: CaseRecord, values: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Motion and missing force of every place along the channels of a simulation, with their units."""
    known = known_parameters(diagnosis.explanations[0])
    # The name tells the observer that the smoothing chosen for the measured record holds for its simulations too.
    simulated = CaseRecord(
        record.name, record.step, record.start, values, record.at_rest, periodic=record.periodic
    )
    out: dict[str, Array] = {}
    units: dict[str, str] = {}
    for observer in observers(diagnosis.problem):
        table = observer.nominal(known)
        observer.estimate(record, table)
        estimate = observer.estimate(simulated, table)
        for j, place in enumerate(observer.places):
            row = place.rows[0]
            columns = (estimate.position @ row, estimate.velocity @ row, estimate.force[:, j])
            own = (place.position_unit, f"{place.position_unit}/s", place.force_unit)
            for name, column, unit in zip(place_channels(place.name), columns, own, strict=True):
                out[name], units[name] = column, unit
    return out, units
