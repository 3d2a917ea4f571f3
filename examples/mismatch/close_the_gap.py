"""The worked example, from a case folder to a model that predicts: ``python close_the_gap.py FOLDER``.

Diagnoses the folder, puts what was found into the user's own model, and runs the judging record in MuJoCo before and after.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from bench.discrepancy import Case, Diagnosis, diagnose_folder
from bench.discrepancy.report.model_update import nominal_estimates
from bench.recording import Recording
from bench.rig import Element, Rig, simulate


def improved(rig: Rig, diagnosis: Diagnosis) -> Rig:
    """The user's model with its numbers re-estimated and the named forces in place."""
    for name, value in nominal_estimates(diagnosis).items():
        kind, _, target = name.partition(":")
        rig = rig.with_structure(**{kind: {target: value}})
    for effect in diagnosis.verdict.named:
        if effect.law:
            rig = rig.with_element(Element.of(effect.law, effect.where or "guide", theta=effect.theta))
    return rig


def gap(rig: Rig, case: Case) -> float:
    """rms(simulated - measured) / std(measured) of the displacement, free run of the judging record in MuJoCo."""
    record = case.validation[0]
    drive = Recording.from_arrays(record.time, {"shaker": record.values["force"]}, units={"shaker": "N"})
    simulated = simulate(rig, drive, sample_rate=1.0 / record.step)["displacement"][: len(record)]
    measured = record.values["displacement"][: len(simulated)]
    return float(np.sqrt(np.mean((simulated - measured) ** 2)) / np.std(measured))


def main(folder: str | Path) -> tuple[Diagnosis, float, float]:
    """Diagnose, improve, compare; returns the diagnosis and the gap before and after."""
    diagnosis = diagnose_folder(folder)
    nominal = Rig.from_file(Path(folder) / diagnosis.case.rig)
    before, after = gap(nominal, diagnosis.case), gap(improved(nominal, diagnosis), diagnosis.case)
    return diagnosis, before, after


if __name__ == "__main__":
    found, before, after = main(sys.argv[1] if len(sys.argv) > 1 else "my-stage")
    print(found.verdict.explanation)
    for effect in found.verdict.named:
        for name, estimate in effect.parameters.items():
            print(f"  {effect.name}: {name} = {estimate.value:.5g} ± {estimate.std:.2g} {estimate.unit}")
    print(f"gap of the judging record in MuJoCo: {before:.3g} before, {after:.3g} after")
