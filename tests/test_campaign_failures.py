"""Records that fail, and answers that are withheld."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.dataset as ds
import pytest
from campaign_plan import SDOF, document

from bench.campaign import plan_from_dict, run_campaign, verify
from bench.campaign.generation import Generator


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "reference"
    run_campaign(document(), folder, threads=1)
    return folder


def test_failing_records_are_set_aside_and_change_nothing_else(tmp_path: Path) -> None:
    # a spring of 1e7 N/m on about 2 kg turns at 2.2e3 rad/s: 2.2 a step, and RK4 diverges above 2.8, so that of
    # 1e6 to 1e8 N/m about half of the records do; a negative clearance never gets as far as the simulation
    rig = json.loads(json.dumps(SDOF))
    rig["elements"] = [
        {
            "law": "linear",
            "joints": ["carriage"],
            "parameters": {"stiffness": {"log_uniform": [1e6, 1e8]}},
        },
        {"law": "gap", "joints": ["carriage"], "parameters": {"clearance": {"uniform": [-0.001, 0.004]}}},
    ]
    plan = document(rigs=[rig])
    result = run_campaign(plan, tmp_path / "diverging")
    rows = ds.dataset(tmp_path / "diverging/records").to_table().to_pylist()
    failed = [row for row in rows if row["status"] == "failed"]
    assert 3 < len(failed) == result.failed < 24
    assert [row["record"] for row in failed] == list(result.failures)
    diverged = [row for row in failed if row["failed_at"] is not None]
    assert all("diverged" in row["reason"] and "carriage.linear" in row["reason"] for row in diverged)
    assert all("clearance" in row["reason"] for row in failed if row["failed_at"] is None)
    assert 0 < len(diverged) < len(failed)
    table = ds.dataset(tmp_path / "diverging/samples").to_table()
    good = [row["record"] for row in rows if row["status"] == "ok"]
    np.testing.assert_array_equal(table["record"].to_numpy(), np.repeat(good, 250))
    generator = Generator(plan_from_dict(plan))
    for record in good[:3]:
        of_record = table.filter(ds.field("record") == record)
        np.testing.assert_array_equal(
            of_record["displacement"].to_numpy(), generator.rebuild(record)["displacement"].astype(np.float32)
        )
    resumed = run_campaign(plan, tmp_path / "diverging")
    assert (resumed.failed, resumed.resumed) == (result.failed, 24)


def test_records_that_mujoco_gives_up_on_are_set_aside(
    reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mujoco.batch import Batch, SimulationError

    rollout = Batch.rollout

    def give_up(batch: Batch, *arguments):
        masses = batch.expand("body_mass").max(axis=1)
        if masses.max() > 2.5:
            raise SimulationError(np.flatnonzero(masses > 2.5), "stack overflow")
        return rollout(batch, *arguments)

    monkeypatch.setattr(Batch, "rollout", give_up)
    result = run_campaign(document(), tmp_path / "given_up")
    rows = ds.dataset(reference / "records").to_table().to_pylist()
    heavy = [row["record"] for row in rows if row["structure/mass/carriage"] > 2.5]
    assert 0 < len(heavy) < 24
    assert list(result.failures) == heavy
    whole = ds.dataset(reference / "samples").to_table(filter=~ds.field("record").isin(heavy))
    assert ds.dataset(tmp_path / "given_up/samples").to_table().equals(whole)


def test_sensors_that_do_not_fit_a_record_fail_that_record(tmp_path: Path) -> None:
    filters = [{"type": "anti_alias", "cutoff": {"uniform": [300.0, 650.0]}}]
    result = run_campaign(document(sensors=[{"chains": {"displacement": filters}}]), tmp_path / "filters")
    rows = ds.dataset(tmp_path / "filters/records").to_table().to_pylist()
    above = [row["record"] for row in rows if row["sensors/displacement/anti_alias/cutoff"] >= 500.0]
    assert 0 < len(above) < 24
    assert list(result.failures) == above
    assert all("anti-alias" in rows[record]["reason"] for record in above)


def test_answers_are_withheld_from_everything_else(tmp_path: Path) -> None:
    rig = json.loads(json.dumps(SDOF))
    rig["structure_withheld"] = True
    rig["elements"][1]["withheld"] = True
    rig["elements"][0]["parameters"]["clearance"] = {
        "uniform": [-0.001, 0.004]
    }  # some records fail and say why
    folder = tmp_path / "blind"
    result = run_campaign(document(rigs=[rig], seed=987_654_321), folder)
    assert result.failed > 0
    public = (folder / "manifest.json").read_text() + (folder / "journal.jsonl").read_text()
    public += str(ds.dataset(folder / "records").to_table().to_pylist()) + str(
        ds.dataset(folder / "samples").schema
    )
    for secret in ("bouc_wen", "987654321", "structure", "uniform': [1.0, 3.0]", "reason"):
        assert secret not in public
    assert "carriage.gap" in public
    answers = ds.dataset(sorted((folder / "answers").glob("*.parquet"))).to_table().to_pylist()
    assert {row["carriage.bouc_wen/present"] for row in answers} == {True, False}
    assert all(1.0 <= row["structure/mass/carriage"] <= 3.0 for row in answers)
    sealed = json.loads((folder / "answers/answers.json").read_text())
    again = plan_from_dict(sealed["plan"])
    assert again.sha256 == json.loads((folder / "manifest.json").read_text())["plan_sha256"]
    for path in (folder / "answers").iterdir():
        path.unlink()
    (folder / "answers").rmdir()  # handed out without the answers
    assert verify(folder) == []
