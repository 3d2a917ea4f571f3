"""The worked example of docs/howto-mismatch.md, from a laboratory that knows nothing of the bench to a model that predicts."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "mismatch"


@pytest.mark.slow
def test_the_worked_example_closes_the_gap_in_the_users_own_model(tmp_path):
    measure = runpy.run_path(str(EXAMPLE / "measure.py"))
    folder = measure["measure"](tmp_path / "my-stage")
    assert sorted(path.name for path in folder.iterdir()) == [
        "identification.csv", "nominal.json", "stage.xml", "validation.csv"
    ]  # fmt: skip
    close_the_gap = runpy.run_path(str(EXAMPLE / "close_the_gap.py"))
    diagnosis, before, after = close_the_gap["main"](folder)
    assert [effect.name for effect in diagnosis.verdict.named] == ["gap"]
    assert diagnosis.verdict.warnings == ()
    found = diagnosis.verdict.named[0].parameters
    for name, truth in (("stiffness", measure["BUFFER_STIFFNESS"]), ("clearance", measure["CLEARANCE"])):
        # five stated standard deviations, and one percent for the integration of the contacts
        assert abs(found[name].value - truth) < 5.0 * found[name].std + 0.01 * truth
    assert before > 0.5
    assert (
        after < 0.05 * before
    )  # MuJoCo holds the load over a step where the shaker had moved on: some percent of the rest
    assert diagnosis.verdict.gap.after < 1.2 * diagnosis.verdict.gap.noise_floor
