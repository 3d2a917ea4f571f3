"""The Silverbox, an electronic Duffing oscillator (Wigren and Schoukens 2013), against a linear nominal model.

SNLS80mV.mat holds voltages at 610.35 Hz: the "arrow" (noise of growing amplitude, the first 40 000 samples),
multisines with short silences between them, and the beginning of a second arrow. The multisines serve to find what is missing,
the whole arrow to judge: it reaches amplitudes that no multisine does.

Both voltages carry a constant of a few millivolts; they are referred to their level in the silences, in which the oscillator
nearly comes to rest. What is left of its motion is estimated as the initial state. The input was measured behind the
generator's filter and is read as band-limited.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.data import (
    DATA_SETTINGS,
    silverbox,
)
from bench.discrepancy import Case, CaseChannel, CaseRecord, NominalParameter, record_from_arrays
from measured.target import Target

TARGET = Target("displacement", "rms", 1e-3, "V")
ARROW = 40_000
QUIET = 60
"""Shortest silence, in samples; the last third of each is averaged for the levels at rest."""
STILL = 4e-3
"""Input voltage about its level [V] that counts as silence, above the ripple of the generator's filter."""
MULTISINES = 1
"""Multisines that are fitted, of ten: 8600 samples leave no parameter of an effect uncertain by more than a percent."""

NOMINAL = (
    NominalParameter("mass", 5.38e-6, 5.4e-8),
    NominalParameter("damping", 2.18e-4, 1.1e-5),
    NominalParameter("stiffness", 0.990, 0.01),
)
"""A linear model fitted to the beginning of the second arrow, whose response stays below 0.03 V and which nothing else uses.

It leaves 0.18 mV of 7 mV there. The circuit is an analogue computer: a volt of input stands for a newton, one of output for a metre.
"""


def cases(data: Path) -> dict[str, Case]:
    """The arrow as a case, from the folder of its file."""
    table = silverbox(data)
    u, y = table["input"], table["output"]
    silences = find_silences(u)
    level_u, level_y = (float(np.mean([x[b - QUIET // 3 : b].mean() for _, b in silences])) for x in (u, y))

    def record(name: str, first: int, last: int) -> CaseRecord:
        part = slice(first, last)
        clock = np.arange(last - first) / DATA_SETTINGS.silverbox_rate
        return record_from_arrays(
            name, clock, {"force": u[part] - level_u, "displacement": y[part] - level_y}, at_rest=False
        )

    channels = (CaseChannel("force", "N", "measured"), CaseChannel("displacement", "m", "response"))
    return {
        "silverbox": Case(
            "silverbox", "sdof", NOMINAL, channels,
            tuple(
                record(f"identification_{i}", silences[i][1] - 5, silences[i + 1][0])
                for i in range(MULTISINES)
            ),
            (record("validation_arrow", 0, ARROW),),
            options={"load_interpolation": "band_limited"},
        )
    }  # fmt: skip


def find_silences(u: np.ndarray) -> list[tuple[int, int]]:
    """First and last sample index of the silences between the multisines: input within `STILL` of its median."""
    calm = np.concatenate([[False], np.abs(u - np.median(u)) < STILL, [False]])
    edges = np.flatnonzero(np.diff(calm.astype(int)))
    runs = zip(edges[::2], edges[1::2], strict=True)
    return [(int(a), int(b)) for a, b in runs if b - a >= QUIET and a > ARROW]
