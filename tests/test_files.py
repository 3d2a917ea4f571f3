"""The one place that writes: whole or not at all, together or not at all, and never over what exists unless told to."""

from __future__ import annotations

import errno
import json
import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from campaign_plan import document
from faulty_system import FaultySystem, Killed

import bench.files
from bench.campaign import verify
from bench.cli import main
from bench.files import (
    OutputError,
    append_line,
    replacing,
    together,
    write_bytes,
    write_text,
)
from bench.targets import check_target_folder, check_targets


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_a_name_holds_the_old_content_or_the_new(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    counting = FaultySystem()
    monkeypatch.setattr(bench.files, "SYSTEM", counting.calls)
    write_text(tmp_path / "counted", "new")
    for way in ("fails", "torn", "killed", "power"):
        for at in range(counting.count):
            folder = tmp_path / f"{way}-{at}"
            folder.mkdir()
            (folder / "result.json").write_text("old")
            monkeypatch.setattr(bench.files, "SYSTEM", FaultySystem(at, way).calls)
            with pytest.raises((OutputError, Killed)):
                write_text(folder / "result.json", "new")
            # all but the wait for the name (the last call) come before the rename
            assert (folder / "result.json").read_text() == ("new" if at == 3 and way != "power" else "old")
            if way in {"fails", "torn"}:
                assert [path.name for path in folder.iterdir()] == ["result.json"]


def test_several_results_are_moved_together_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write_all(folder: Path) -> None:
        with together():
            write_text(folder / "verdict.json", "new")
            write_bytes(folder / "deeper" / "page.html", b"new")
            with replacing(folder / "other.rrd") as temporary:
                temporary.write_bytes(b"new")
            assert not (folder / "deeper" / "page.html").exists()

    counting = FaultySystem()
    monkeypatch.setattr(bench.files, "SYSTEM", counting.calls)
    write_all(tmp_path / "whole")
    assert everything(tmp_path / "whole") == dict.fromkeys(
        ("deeper/page.html", "other.rrd", "verdict.json"), b"new"
    )
    for at in range(counting.count):
        folder = tmp_path / str(at)
        folder.mkdir()
        (folder / "verdict.json").write_text("old")
        monkeypatch.setattr(bench.files, "SYSTEM", FaultySystem(at).calls)
        with pytest.raises(OutputError):
            write_all(folder)
        assert everything(folder) == {"verdict.json": b"old"}, at


def test_an_exception_between_two_results_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "verdict.json").write_text("old")

    def stopped() -> None:
        with together():
            write_text(tmp_path / "verdict.json", "new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert everything(tmp_path) == {"verdict.json": b"old"}
    write_text(tmp_path / "verdict.json", "new")  # and the next is not held back
    assert everything(tmp_path) == {"verdict.json": b"new"}


def test_files_are_for_whom_the_users_habit_lets_them_be(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "mine", "text")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "mine").stat().st_mode) == 0o640


def test_a_device_or_a_folder_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "folder"):
        with pytest.raises(OutputError, match="name a file"):
            write_text(tmp_path / name, "text")
        with pytest.raises(OutputError, match="name a file"):
            check_targets(tmp_path / name, force=True)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int, content: bytes | memoryview) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(bench.files, "SYSTEM", bench.files.SystemCalls(write=full))
    with pytest.raises(OutputError, match=r"mine: No space left on device; free some space"):
        write_text(tmp_path / "mine", "text")


def test_lines_outlive_a_torn_one(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    append_line(path, "one")
    path.write_bytes(path.read_bytes() + b"tw")
    append_line(path, "three")
    assert path.read_text() == "one\ntw\nthree\n"
    (tmp_path / "link").symlink_to(path)
    with pytest.raises(OutputError):
        append_line(tmp_path / "link", "four")


def test_places_are_checked_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "there").write_text("mine")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    check_targets(None, "-", tmp_path / "new" / "deep" / "file")
    check_targets(tmp_path / "there", force=True)
    for path in ("there", "dangling"):
        with pytest.raises(OutputError, match="--force"):
            check_targets(tmp_path / path)
    with pytest.raises(OutputError, match="two results"):
        check_targets(tmp_path / "a", tmp_path / "." / "a")
    with pytest.raises(OutputError, match="no folder"):
        check_targets(tmp_path / "there" / "in a file")
    with pytest.raises(OutputError, match="too long"):
        check_targets(tmp_path / ("n" * 300))
    check_target_folder(tmp_path / "new")
    with pytest.raises(OutputError, match="--force"):
        check_target_folder(tmp_path)
    check_target_folder(tmp_path, force=True)
    check_target_folder(tmp_path, own=("th*",))


RIG = """
rig = "sdof"
[[elements]]
law = "gap"
joints = ["carriage"]
[excitation]
duration = 0.1
sample_rate = 1000.0
[excitation.signals.shaker]
type = "harmonic"
frequency = 5.0
amplitude = 1.0
"""


@pytest.mark.slow
def test_commands_overwrite_nothing_without_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG)
    monkeypatch.setattr("bench.rig.simulate", lambda *_, **__: pytest.fail("ran"))
    mine = tmp_path / "mine.parquet"
    for words in (
        ["simulate", str(rig), "-o"],
        ["view", str(rig), "-o"],
        ["diagnose", str(tmp_path), "--json"],
        ["diagnose", str(tmp_path), "--html"],
        ["blind", "score", str(tmp_path), str(tmp_path), "--markdown"],
        ["demo", "--out"],
        ["reproduce", "--out"],
    ):
        mine.write_text("mine")
        place = str(tmp_path) if words[0] in {"demo", "reproduce"} else str(mine)
        assert main([*words, place]) == 2
        assert "--force" in capsys.readouterr().err
        assert mine.read_text() == "mine"
    monkeypatch.undo()
    assert main(["simulate", str(rig), "-o", str(mine), "--force"]) == 0
    assert mine.read_bytes()[:4] == b"PAR1"


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_campaign_that_is_told_to_stop_leaves_whole_parts_only(
    number: int, status: int, tmp_path: Path
) -> None:
    plan, folder = tmp_path / "plan.json", tmp_path / "out"
    plan.write_text(json.dumps(document(records=4000, records_per_part=40, duration=1.0)))
    # a shell's background jobs inherit that they do not hear SIGINT, a person's do
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}; import sys; from bench.cli import main; sys.exit(main())"
    child = subprocess.Popen(
        [sys.executable, "-c", code, "campaign", str(plan), "--out", str(folder), "--threads", "2", "--json"],
        cwd=Path(__file__).parents[1],
        stderr=subprocess.PIPE,
        text=True,
    )
    while not list((folder / "samples").glob("*.parquet")):
        assert child.poll() is None
        time.sleep(0.01)
    child.send_signal(number)
    _, told = child.communicate(timeout=60)
    assert (child.returncode, told) == (status, "jointbench: stopped\n")
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["status"] == "stopped"
    assert verify(folder) == []
    assert len(manifest["parts"]) == len(list((folder / "samples").iterdir())) < 100
    hidden = {path.name for path in folder.rglob(".*") if path.is_file()}
    assert hidden == {".lock"}
