"""Compiled kernels without a place to keep them: a read-only package, no home."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bench import kernel_cache

SIMULATE = """
import os, sys
allowed = os.access
os.access = lambda path, mode: allowed(path, mode) and not (mode & os.W_OK and os.sep + "bench" in str(path))
import numpy as np
from bench import Element, sdof_rig, simulate
record = simulate(sdof_rig(Element.of("gap", "carriage")), {"shaker": np.ones(20)})
print(os.environ["NUMBA_CACHE_DIR"], record["displacement"].max() > 0.0)
"""


@pytest.mark.slow
def test_without_any_place_of_its_own_a_simulation_runs_from_a_temporary_folder(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.write_text("no folder")
    bare = {
        key: value for key, value in os.environ.items() if key not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}
    }
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", SIMULATE],
            env=bare | {"HOME": str(home), "TMPDIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        folder, moved = done.stdout.split()
        assert moved == "True"
        assert Path(folder).parent == tmp_path
        assert list(Path(folder).rglob("*passive*.nbi"))
    assert len(list(tmp_path.glob("jointbench-kernels-*"))) == 1


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    monkeypatch.setattr(kernel_cache, "_beside", lambda package: False)
    monkeypatch.setattr(kernel_cache.tempfile, "tempdir", str(tmp_path))
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    return tmp_path


@pytest.mark.skipif(sys.platform != "linux", reason="sets the home of Linux")
def test_a_temporary_folder_that_others_may_write_to_is_not_used(nowhere: Path) -> None:
    first = kernel_cache.provide(nowhere)
    assert first is not None
    assert first.stat().st_mode & 0o777 == 0o700
    os.environ.pop("NUMBA_CACHE_DIR")
    first.chmod(0o777)
    second = kernel_cache.provide(nowhere)
    os.environ.pop("NUMBA_CACHE_DIR")
    assert second not in {None, first}
    first.rmdir()
    first.symlink_to(nowhere)
    assert kernel_cache.provide(nowhere) not in {None, first, second}
    os.environ.pop("NUMBA_CACHE_DIR")


def test_who_has_set_numbas_folder_is_obeyed_and_a_home_is_enough(
    nowhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(nowhere / "home"))
    assert kernel_cache.provide(nowhere) is None
    monkeypatch.setenv("HOME", str(nowhere / "file"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(nowhere / "own"))
    assert kernel_cache.provide(nowhere) is None
    assert os.environ["NUMBA_CACHE_DIR"] == str(nowhere / "own")


def test_without_a_single_folder_to_write_to_the_package_still_imports(
    nowhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel_cache.tempfile, "tempdir", str(nowhere / "none"))
    assert kernel_cache.provide(nowhere) is None
