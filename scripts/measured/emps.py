"""The electro-mechanical positioning system as a case for the diagnosis: nominal model of mass and viscous damping only.

The drive's command [V] times its published gain [N/V] is the load; the encoder gives the position. Both are brought from
1 kHz to 200 Hz behind one and the same zero-phase filter, which leaves their linear relation as it is: the motion of interest
ends below 20 Hz. The carriage is free, so nothing is said about a start: the record begins in motion and the
diagnosis restarts in windows.

The noise of neither channel is published, so none is stated, and explanations are weighed by what they take away.

The published model (Coulomb friction and a constant offset) is not all there is in this record. Least squares of the force
below 5 Hz leave 1.6 N with it, but 0.76 N with a term in the magnitude of the velocity, beside which the offset shrinks from
-3.2 N to -0.2 N: the viscous damping depends on the direction. The diagnosis finds that (`asymmetric_damping`) beside
friction, and predicts the rest of the record several times better than the published pair; the catalogue learned the effect,
which every vehicle damper has, after it was seen here. No third effect of the catalogue beside friction and the offset leaves as
little as these two do.

References:
    A. Janot, M. Gautier, M. Brunot, Data set and reference models of EMPS, Workshop on Nonlinear System Identification
    Benchmarks, Eindhoven 2019.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import decimate

from bench.data import emps
from bench.discrepancy.case.case import Case, CaseChannel, NominalParameter, record_from_arrays

FACTOR = 5
"""Samples at 1 kHz for one of the case."""
SHARE = 0.75
"""Part of the record that serves for finding; the rest judges."""
PUBLISHED = {"mass": 95.1089, "damping": 203.5034, "friction_force": 20.3935, "offset": -3.1648}
"""Published estimates [kg, N s/m, N, N], of a model with friction and offset."""


def cases(data: Path) -> dict[str, Case]:
    """Build the case from the folder that holds ``DATA_EMPS.mat``.

    Args:
        data: Folder of the measured data set.
    """
    record = emps(data)
    force, position = record["force"], record["displacement"]
    step = FACTOR / record.sample_rate
    force, position = (decimate(x, FACTOR, ftype="fir", zero_phase=True) for x in (force, position))
    clock = step * np.arange(len(force))
    end = int(SHARE * len(force))
    parts = {"identification": slice(0, end), "validation": slice(end, None)}
    records = {
        name: record_from_arrays(
            name, clock[part], {"force": force[part], "displacement": position[part]}, at_rest=False
        )
        for name, part in parts.items()
    }
    case = Case(
        "emps",
        "sdof",
        (NominalParameter("mass", 100.0, 15.0, "kg"), NominalParameter("damping", 250.0, 100.0, "N s/m")),
        (
            CaseChannel("force", "N", "measured"),
            CaseChannel("displacement", "m", "response"),
        ),
        (records["identification"],),
        (records["validation"],),
    )
    return {"emps": case}
