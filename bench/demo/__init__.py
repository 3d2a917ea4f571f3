"""The main job: real friction damper and deck joint, identified, swapped in and compared on unseen tests, and a diagnosis.

`compute` sees what a laboratory sees: motion and force records; the unseen tests' forces serve the scores and nothing
else. `bench.demo.report.write` makes a page, a rerun recording and Parquet records of the result.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.demo.damper import (
    DAMPER_SETUP,
    DamperTest,
    damper_test,
)
from bench.demo.joint import DemoJoint, ShowProgress, joint_models, training_records, unseen_record
from bench.demo.measured_case import damper_case
from bench.recording import Recording

if TYPE_CHECKING:
    from bench.discrepancy.diagnosis import Diagnosis


@dataclass(frozen=True)
class DemoSetup:
    """Numbers of `bench.demo`."""

    thin: int = 8
    """Every so manieth sample goes to the diagnosis: 128 a second, 128 a cycle at 1 Hz."""


SETUP = DemoSetup()


def _by_axis(pair: tuple[float, float] | None) -> dict[str, float] | None:
    return None if pair is None else {"axial": pair[0], "torsional": pair[1]}


@dataclass(frozen=True)
class DemoResult:
    """Everything that the demo found.

    Attributes:
        damper: Unseen damper tests by tension.
        joint: Reduced-order joints on the unseen excitation.
        training: Training records of the joint: axial, torsional, both.
        unseen: The true joint's record of the unseen test.
        diagnosis: What the real friction damper shows that a nominal model with Coulomb friction lacks.
        seconds: Wall-clock time [s] of the computation.
    """

    damper: tuple[DamperTest, ...]
    joint: tuple[DemoJoint, ...]
    training: tuple[Recording, ...] = field(repr=False)
    unseen: Recording = field(repr=False)
    diagnosis: Diagnosis = field(repr=False)
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Figures as JSON values."""
        return {
            "damper": [
                {"tension_lbf": t.tension, "force_nrmse": t.nrmse, "outside": t.outside} for t in self.damper
            ],
            "joint": [
                {
                    "model": m.label,
                    "force_nmse_percent": _by_axis(m.force_nmse),
                    "open_loop_force_nmse_percent": _by_axis(m.open_loop_nmse),
                    "nmse_percent": m.comparison.nmse if m.comparison else None,
                    "note": m.note or None,
                    "fit_seconds": m.seconds,
                }
                for m in self.joint
            ],
            "diagnosis": self.diagnosis.verdict.to_json(),
            "seconds": self.seconds,
        }


def compute(progress: ShowProgress = lambda label, share: None) -> DemoResult:
    """Run all parts of the demo.

    Args:
        progress: Called with what is being done and the share done.
    """
    start = time.perf_counter()
    damper = []
    for number, tension in enumerate(DAMPER_SETUP.tensions):
        progress(
            f"damper: identifying at {tension} lbf band tension", 0.3 * number / len(DAMPER_SETUP.tensions)
        )
        damper.append(damper_test(tension, np.random.default_rng(tension)))
    progress("joint: simulating the training records", 0.3)
    records = training_records()
    unseen = unseen_record()
    joint = joint_models(records, unseen, progress, (0.32, 0.85))
    from bench.discrepancy import Diagnosis, diagnose  # noqa: PLC0415  (compiled code, for this part only)

    found = diagnose(
        damper_case(thin=SETUP.thin),
        most=1,
        progress=lambda text: progress(f"diagnosis of the damper: {text}", 0.85),
    )
    assert isinstance(found, Diagnosis)  # a component is no articulated model
    progress("done", 1.0)
    return DemoResult(tuple(damper), tuple(joint), records, unseen, found, time.perf_counter() - start)
