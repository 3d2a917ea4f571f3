"""Where channels count from: the zero of the model's coordinates, or the position of rest.

Gravity on a slide and a spring that is tight at the reference position (``springref``) move the position of rest; an accelerometer reads
gravity there. The structure of a diagnosis counts from rest, as most sensors are zeroed. Records that count from the model's own zero,
as all do that MuJoCo made, stay around the model's reading at rest instead of around zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.checks.reference import MujocoReference


def counted_from_rest(case: Case, reference: MujocoReference) -> tuple[Case, tuple[str, ...]]:
    """A case whose channels count from rest, and which of them did not, in words.

    Args:
        case: The case.
        reference: The model in MuJoCo, for its readings at rest.
    """
    if reference.unsteady:
        return case, ()
    records = (*case.identification, *case.validation)
    shifts: dict[str, float] = {}
    for name, offset in zip(reference.responses, reference.offsets, strict=True):
        means = np.array([float(np.mean(record.values[name])) for record in records])
        if offset and np.sum(np.abs(means - offset)) < np.sum(np.abs(means)):
            shifts[name] = float(offset)

    def shifted(record: CaseRecord) -> CaseRecord:
        values = dict(record.values)
        for name, offset in shifts.items():
            values[name] = record.values[name] - offset
            values[name].setflags(write=False)
        return replace(record, values=values)

    if not shifts:
        return case, ()
    said = tuple(
        f"'{name}' counts from the zero of the model, where rest is at {offset:.4g} {case.channel(name).unit}: that is taken off"
        for name, offset in shifts.items()
        if abs(offset) > (case.channel(name).noise_std or 0.0)
    )
    return (
        replace(
            case,
            identification=tuple(shifted(record) for record in case.identification),
            validation=tuple(shifted(record) for record in case.validation),
        ),
        said,
    )
