"""The real friction damper that comes with the bench, held against a nominal model that knows Coulomb friction only.

Two cases a band tension: the test at one frequency serves to find what is missing, the test at the other to judge, so that
each of the eight tests is judged once, unseen. The nominal friction force is what a person reads off the loop of the first:
the median of the force against the direction of motion, and how it scatters.

At 1 Hz the band grips with a jolt that rings at some 40 to 50 Hz, hardly seen at 0.5 Hz. No law of the catalogue rings so: of the
test at 1 Hz and 20 lb an elastic-slip element with backlash leaves 0.23 even when fitted to that test itself. Neither a
resonance between force and sensor nor a sliding mass behind the play, fitted to the test at 0.5 Hz, brings the other below 0.23.
The prescribed displacement rings with it, in antiphase to the force and in the same proportion at every tension: the drive gives
way to the force, which is why the motion tells the force there although no law of the motion makes it. Predicting the one by the
other would be reading a second load cell, not a model of the damper.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.data import friction_damper
from bench.demo.damper import (
    DAMPER_SETUP,
)
from bench.discrepancy import Case, CaseChannel, CaseRecord, NominalParameter, record_from_arrays
from measured.target import Target

SHIPPED = True
TARGET = Target("force", "nrmse", 0.2, "1")


def cases(data: Path | None = None) -> dict[str, Case]:
    """Two cases for every band tension, named after the test that judges; `data` is not needed."""
    found = [damper_case(tension, judged) for tension in DAMPER_SETUP.tensions for judged in ("1Hz", "0.5Hz")]
    return {case.name: case for case in found}


def damper_case(tension: int, judged: str) -> Case:
    """The tests at one band tension, in SI units; that at the frequency `judged` ("0.5Hz" or "1Hz") is for judging."""
    seen = {"1Hz": "0.5Hz", "0.5Hz": "1Hz"}[judged]
    found = _record("identification", f"{seen}_{tension}lb")
    opposed = found.values["force"] * np.sign(np.gradient(found.values["displacement"]))
    quartiles = np.percentile(opposed, [25, 50, 75])
    scatter = float(quartiles[2] - quartiles[0]) / 1.35
    channels = (CaseChannel("displacement", "m", "prescribed"), CaseChannel("force", "N", "response"))
    return Case(
        f"friction_damper_{tension}lb_{judged}", "damper",
        (NominalParameter("coulomb", float(quartiles[1]), scatter, "N"),), channels, (found,),
        (_record("validation", f"{judged}_{tension}lb"),),
    )  # fmt: skip


def _record(name: str, test: str) -> CaseRecord:
    record = friction_damper(test).to_si()
    return record_from_arrays(
        name, record.time, {channel: record[channel] for channel in ("displacement", "force")}
    )
