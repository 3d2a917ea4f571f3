"""Running campaigns: the same bytes however they are run, stopped, killed or resumed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from campaign_plan import document

from bench.campaign import CampaignError, Progress, means, plan_from_dict, read_plan, run_campaign, verify
from bench.campaign.execution import generator_of, payload_of
from bench.campaign.generation import Generator
from bench.campaign.journal import Journal
from bench.campaign.store import Store
from bench.campaign.versions import versions
from bench.errors import FileFormatError, ParameterError


def hashes(folder: Path) -> dict[str, str]:
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["status"] == "complete"
    assert verify(folder) == []
    return {
        f"{kind}/{entry['part']}": file["sha256"]
        for entry in manifest["parts"]
        for kind, file in entry["files"].items()
    }


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "reference"
    run_campaign(document(), folder, threads=1)
    return folder


RIGS = {
    "sdof, every structural number": document(
        channels=[
            "shaker",
            "displacement",
            "carriage.gap/force",
            "carriage.bouc_wen/z",
            "carriage.bouc_wen/force",
        ],
        precision="float64",
    ),
    "exact friction, armature, frictionloss": document(
        precision="float64",
        rigs=[
            {
                "rig": "sdof",
                "structure": {
                    "armature": {"carriage": {"uniform": [0.0, 0.5]}},
                    "inertia": {"carriage": 0.01},
                    "stiffness": {"carriage": 900.0},
                },
                "elements": [
                    {
                        "law": "coulomb",
                        "joints": ["carriage"],
                        "exact": True,
                        "parameters": {"limit": {"uniform": [1.0, 4.0]}},
                    }
                ],
            }
        ],
    ),
    "damper under prescribed motion": document(
        sample_rate=1024.0,
        channels=["displacement", "piston.bouc_wen/force"],
        precision="float64",
        sensors=[],
        rigs=[
            {
                "rig": "damper",
                "elements": [
                    {"law": "bouc_wen", "joints": ["piston"], "parameters": {"A": {"uniform": [5.0, 9.0]}}}
                ],
            }
        ],
        excitations=[
            {
                "prescribe": "piston",
                "signals": {
                    "piston": {
                        "type": "harmonic",
                        "frequency": 2.0,
                        "amplitude": {"uniform": [0.002, 0.01]},
                        "phase": 1.0,
                    }
                },
            }
        ],
    ),
    "coupled joint, slower record, held drive": document(
        sample_rate=250.0,
        duration=0.4,
        drive_rate=500.0,
        precision="float64",
        channels=["force", "joint/force_1", "joint/displacement_2"],
        sensors=[],
        rigs=[
            {
                "rig": "joint",
                "elements": [
                    {"law": "axial_torsional_joint", "joints": ["axial", "torsional"], "name": "joint"}
                ],
            },
            {"rig": "joint", "name": "free", "elements": [{"law": "linear", "joints": ["axial"]}]},
        ],
        excitations=[
            {
                "signals": {
                    "force": {"type": "harmonic", "frequency": {"uniform": [1.0, 5.0]}, "amplitude": 10.0}
                }
            }
        ],
    ),
}


@pytest.mark.parametrize("name", RIGS)
def test_records_are_those_of_simulate_and_measure_to_the_last_bit(name: str) -> None:
    generator = Generator(plan_from_dict(RIGS[name]))
    part = generator.part(1)
    assert part.failures == []
    compared = 0
    for place, record in enumerate(part.good):
        alone = generator.rebuild(record)
        for row, channel in enumerate(generator.channels):
            assert part.has[row, place] == (channel.name in alone.names)
            if part.has[row, place]:
                np.testing.assert_array_equal(part.values[row, place], alone[channel.name])
                compared += 1
    assert compared > 5


def test_same_bytes_for_any_number_of_threads(reference: Path, tmp_path: Path) -> None:
    run_campaign(document(), tmp_path / "threads", threads=3)
    assert hashes(tmp_path / "threads") == hashes(reference)
    generator = generator_of(payload_of(plan_from_dict(document())))
    np.testing.assert_array_equal(generator.part(2, threads=1).values, generator.part(2, threads=2).values)


def test_records_do_not_depend_on_how_they_are_cut_into_parts(reference: Path, tmp_path: Path) -> None:
    run_campaign(document(records_per_part=7), tmp_path / "other")
    for kind in ("samples", "records"):
        here, there = (ds.dataset(folder / kind).to_table() for folder in (reference, tmp_path / "other"))
        assert here.equals(there)


def test_data_set_reads_as_it_is(reference: Path) -> None:
    table = ds.dataset(reference / "samples").to_table()
    assert table.num_rows == 24 * 250
    np.testing.assert_array_equal(table["record"].to_numpy(), np.repeat(np.arange(24), 250))
    np.testing.assert_array_equal(table["sample"].to_numpy(), np.tile(np.arange(250), 24))
    assert table.schema.field("displacement").metadata[b"unit"] == b"m"
    one = ds.dataset(reference / "samples").to_table(filter=ds.field("record") == 17)
    alone = Generator(plan_from_dict(document())).rebuild(17)
    np.testing.assert_array_equal(one["velocity"].to_numpy(), alone["velocity"].astype(np.float32))
    drawn = ds.dataset(reference / "records").to_table().to_pylist()
    present = [row["carriage.bouc_wen/present"] for row in drawn]
    assert 0 < sum(present) < 24
    assert all((row["carriage.bouc_wen/A"] is None) != has for row, has in zip(drawn, present, strict=True))
    assert all(1.0 <= row["structure/mass/carriage"] <= 3.0 for row in drawn)


def test_tables_and_documented_seeds_are_enough_to_make_a_record_again(reference: Path) -> None:
    from bench import Element, Excitation, sdof_rig, simulate
    from bench.measurement import Chain, Noise, measure
    from bench.signals import BandLimitedNoise

    row = ds.dataset(reference / "records").to_table().to_pylist()[5]
    gap = {name: row[f"carriage.gap/{name}"] for name in ("stiffness", "clearance", "damping", "offset")}
    elements = [Element.of("gap", "carriage", **gap)]
    if row["carriage.bouc_wen/present"]:
        loop = {name: row[f"carriage.bouc_wen/{name}"] for name in ("A", "beta", "gamma", "n")}
        elements.append(Element.of("bouc_wen", "carriage", **loop))
    numbers = {kind: row[f"structure/{kind}/carriage"] for kind in ("mass", "stiffness", "damping")}
    _, drive, sensors = np.random.SeedSequence(11, spawn_key=(5,)).spawn(3)
    noise = BandLimitedNoise(60.0, rms=row["excitation/shaker/rms"])
    true = simulate(
        sdof_rig(*elements, **numbers),
        Excitation({"shaker": noise}, 0.25, 1000.0),
        rng=np.random.default_rng(drive),
    )
    chain = Chain(Noise(row["sensors/displacement/noise/std"]))
    measured = measure(true, {"displacement": chain}, np.random.default_rng(sensors))
    stored = ds.dataset(reference / "samples").to_table(filter=ds.field("record") == 5)
    for channel in ("shaker", "displacement", "velocity", "acceleration_x"):
        np.testing.assert_array_equal(stored[channel].to_numpy(), measured[channel].astype(np.float32))


def test_prescribed_motion_is_followed() -> None:
    generator = Generator(plan_from_dict(RIGS["damper under prescribed motion"]))
    part = generator.part(0)
    time_of = np.arange(256) / 1024.0
    for place, draw in enumerate(part.draws):
        asked = draw.values["excitation/piston/amplitude"] * np.sin(4.0 * np.pi * time_of + 1.0)
        # 0.1 % of the amplitude: what the servo of the damper rig leaves, as its own tests measure
        assert np.max(np.abs(part.values[0, place] - asked)) < 1e-3 * float(
            draw.values["excitation/piston/amplitude"]
        )


def test_one_record_is_one_row_group_of_long_records(tmp_path: Path) -> None:
    run_campaign(document(records=2, duration=9.0, records_per_part=2), tmp_path / "long")
    assert pq.ParquetFile(tmp_path / "long/samples/part-000000.parquet").num_row_groups == 2


def test_resumes_after_a_stop_without_loss_or_repetition(reference: Path, tmp_path: Path) -> None:
    def stop(progress: Progress) -> None:
        if progress.records >= 9:
            raise KeyboardInterrupt

    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        run_campaign(document(), folder, threads=1, progress=stop)
    assert json.loads((folder / "manifest.json").read_text())["status"] == "stopped"
    before = {path: path.stat().st_mtime_ns for path in (folder / "samples").iterdir()}
    assert 3 <= len(before) < 8
    result = run_campaign(document(), folder)
    assert result.resumed == 3 * len(before)
    assert hashes(folder) == hashes(reference)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert run_campaign(document(), folder).resumed == 24


@pytest.mark.parametrize("lasting", [False, True])
def test_a_stop_before_a_part_is_noted_leaves_no_part_unnoted(
    lasting: bool, reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted, calls = Journal.note, iter(range(100))

    def note(journal: Journal, plan_sha256: str, entry: Mapping[str, Any]) -> None:
        call = next(calls)
        if call == 2 or (lasting and call > 2):
            raise KeyboardInterrupt
        noted(journal, plan_sha256, entry)

    folder = tmp_path / "stopped"
    monkeypatch.setattr(Journal, "note", note)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(document(), folder, threads=2)
    monkeypatch.undo()
    assert json.loads((folder / "manifest.json").read_text())["status"] == "stopped"
    assert verify(folder) == []
    run_campaign(document(), folder)
    assert hashes(folder) == hashes(reference)


def test_what_a_crash_can_leave_behind_is_cleared(reference: Path, tmp_path: Path) -> None:
    folder = tmp_path / "torn"
    folder.mkdir()
    (folder / ".manifest.json.ab12.json").write_text("{")  # killed while the first manifest was written
    run_campaign(document(), folder)
    assert not list(folder.glob(".manifest*"))
    (folder / "samples/part-000003.parquet").unlink()  # killed between the records and the samples of a part
    (folder / ".partial/samples-part-000003.parquet.ab12").write_bytes(b"PAR1 half")
    journal = (folder / "journal.jsonl").read_text().splitlines()
    (folder / "journal.jsonl").write_text(
        "\n".join(journal[:5]) + '\n{"part": 4, "fir'
    )  # a torn line, and parts not noted, which the manifest holds
    result = run_campaign(document(), folder)
    assert result.resumed == 21
    assert any("journal.jsonl" in line for line in result.found)
    assert any("samples/part-000003.parquet is missing" in line for line in result.found)
    assert hashes(folder) == hashes(reference)
    assert not list((folder / ".partial").iterdir())


LONGER = {"records": 120, "records_per_part": 2, "duration": 2.0}


def _child(plan: Path, folder: Path, *arguments: str) -> subprocess.Popen:
    code = f"from bench.campaign import run_campaign; run_campaign({str(plan)!r}, {str(folder)!r}, {', '.join(arguments)})"
    return subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[1])


@pytest.mark.slow
def test_resumes_after_kill_9_without_loss_or_repetition(tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    plan.write_text(json.dumps(document(**LONGER)))
    folder = tmp_path / "killed"
    for least in (3, 12):  # killed twice, at whatever it is doing then
        child = _child(plan, folder, "threads=2")
        while len(list((folder / "samples").glob("*.parquet"))) < least:
            assert child.poll() is None
            time.sleep(0.002)
        child.send_signal(signal.SIGKILL)
        child.wait()
        done = sorted((folder / "samples").glob("*.parquet"))
        assert least <= len(done) < 60
        for path in done:  # whole files only
            pq.read_table(path)
    assert json.loads((folder / "manifest.json").read_text())["status"] == "running"
    result = run_campaign(plan, folder)
    # whole parts that were not noted yet are made again: one a thread, and those that waited for the others' note to be flushed
    assert (result.records, result.failed) == (120, 0)
    assert 2 * (len(done) - 2 * 3) <= result.resumed <= 2 * len(done)
    table = ds.dataset(folder / "samples").to_table(columns=["record"])
    np.testing.assert_array_equal(table["record"].to_numpy(), np.repeat(np.arange(120), 2000))
    run_campaign(plan, tmp_path / "whole")
    assert hashes(folder) == hashes(tmp_path / "whole")


@pytest.mark.slow
def test_same_bytes_from_processes_one_of_which_is_killed(reference: Path, tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(progress: Progress) -> None:
        if not killed:
            import multiprocessing

            child = multiprocessing.active_children()[0]
            assert child.pid is not None
            os.kill(child.pid, signal.SIGKILL)
            killed.append(child.pid)

    result = run_campaign(document(), tmp_path / "processes", workers=2, progress=kill)
    assert killed
    assert result.means.startswith("2 processes")
    assert hashes(tmp_path / "processes") == hashes(reference)


def test_progress_tells_rate_and_time_left(tmp_path: Path) -> None:
    seen: list[Progress] = []
    run_campaign(document(), tmp_path / "seen", threads=1, progress=seen.append)
    assert [state.records for state in seen] == list(range(3, 25, 3))
    assert all(state.rate == pytest.approx(state.records / state.elapsed) for state in seen)
    assert seen[0].left > seen[-1].left == 0.0


def test_folders_of_others_are_left_alone(reference: Path, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="another plan"):
        run_campaign(document(seed=12), reference)
    with pytest.raises(CampaignError, match="already"):
        run_campaign(document(), reference, resume=False)
    (tmp_path / "letters.txt").write_text("mine")
    with pytest.raises(CampaignError, match="other files"):
        run_campaign(document(), tmp_path)
    with pytest.raises(ParameterError, match="workers"):
        run_campaign(document(), tmp_path / "new", workers=0)
    with pytest.raises(FileFormatError, match="no campaign"):
        verify(tmp_path)


def test_other_versions_do_not_mix_into_a_campaign(reference: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from bench.campaign import store

    monkeypatch.setattr(store, "versions", lambda: {"mujoco": "4.0.99"})
    with pytest.raises(CampaignError, match=r"4\.0\.99"):
        run_campaign(document(), reference)


def test_two_runs_do_not_work_in_one_folder(tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    met: list[CampaignError] = []

    def intrude(progress: Progress) -> None:
        if not met:
            with pytest.raises(CampaignError, match="another process") as caught:
                run_campaign(document(), folder)
            met.append(caught.value)

    run_campaign(document(), folder, threads=1, progress=intrude)
    assert met


def test_damage_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "damaged"
    run_campaign(document(), folder)
    path = folder / "samples/part-000002.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    (folder / "records/part-000001.parquet").unlink()
    assert verify(folder) == [
        "records/part-000001.parquet is missing",
        "samples/part-000002.parquet differs from what was written",
    ]


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        ({"records": 1e308}, "more than 100000000 records"),
        ({"records": 10**8, "records_per_part": 1}, "more than 40000 parts"),
    ],
)
def test_a_manifest_of_more_than_a_plan_can_ask_for_is_damaged(
    reference: Path, tmp_path: Path, entries: dict[str, float], told: str
) -> None:
    folder = tmp_path / "endless"
    folder.mkdir()
    manifest = json.loads((reference / "manifest.json").read_text())
    manifest["plan"] |= entries
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(FileFormatError, match=told):
        verify(folder)


@pytest.mark.slow
def test_a_cluster_gives_the_same_bytes_though_a_worker_is_killed(tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    plan = read_plan(_written(tmp_path / "plan.json", document(records=60)))
    killed: list[int] = []
    with (
        LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        workers = list(client.run(os.getpid).values())

        def kill(progress: Progress) -> None:
            if not killed:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])

        result = run_campaign(plan, tmp_path / "cluster", scheduler=cluster.scheduler_address, progress=kill)
    assert len(set(workers)) == 3
    assert killed
    assert (result.records, result.failed) == (60, 0)
    run_campaign(plan, tmp_path / "alone")
    assert hashes(tmp_path / "cluster") == hashes(tmp_path / "alone")


def _written(path: Path, plan: dict) -> Path:
    path.write_text(json.dumps(plan))
    return path


def test_an_absent_scheduler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import Client

    def refuse(address: str, timeout: float) -> Client:
        raise OSError(f"timed out connecting to {address}")

    monkeypatch.setattr("distributed.Client", refuse)
    with pytest.raises(CampaignError, match=r"tcp://127\.0\.0\.1:9"):
        run_campaign(document(), tmp_path / "none", scheduler="tcp://127.0.0.1:9")


def test_workers_that_see_another_disk_or_hold_other_software_are_refused(tmp_path: Path) -> None:
    store = Store(tmp_path)
    (tmp_path / ".partial").mkdir()
    (tmp_path / "manifest.json").write_text("{}")  # an older state of the campaign on the worker's own disk

    class Client:
        def __init__(self, word: str | None, there: dict[str, str]) -> None:
            self.word, self.there = word, there

        def run(self, task, *arguments):
            return {"tcp://a:1": self.there if task is versions else self.word or task(*arguments)}

    assert means._check_workers(Client(None, versions()), store) == 1
    with pytest.raises(CampaignError, match="does not see"):
        means._check_workers(Client("another word", versions()), store)
    with pytest.raises(CampaignError, match=r"mujoco 0\.1"):
        means._check_workers(Client(None, versions() | {"mujoco": "0.1"}), store)
    payload = json.loads(payload_of(plan_from_dict(document())))  # and one that joins later
    payload["versions"]["numpy"] = "0.1"
    with pytest.raises(CampaignError, match=r"here 0\.1"):
        generator_of(json.dumps(payload))


def test_a_part_that_goes_while_the_campaign_runs_is_missed(reference: Path, tmp_path: Path) -> None:
    folder = tmp_path / "robbed"

    def rob(progress: Progress) -> None:
        (folder / "samples/part-000000.parquet").unlink(missing_ok=True)

    with pytest.raises(CampaignError, match=r"part-000000\.parquet is not there"):
        run_campaign(document(), folder, threads=1, progress=rob)
    assert json.loads((folder / "manifest.json").read_text())["status"] == "stopped"
    assert "samples/part-000000.parquet is missing" in verify(folder)
    run_campaign(document(), folder)
    assert hashes(folder) == hashes(reference)
