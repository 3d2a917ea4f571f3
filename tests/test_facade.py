"""``import jointbench`` and environments without an import, beside folders of the user's that have the names of the bench's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import bench
import envs

ROOT = Path(__file__).resolve().parents[1]
ALIASES = """
import sys
import jointbench
assert "bench" not in sys.modules
assert jointbench.__version__
from jointbench.signals import Harmonic
import jointbench.rig.library
import bench.rig.library, bench.signals
assert sys.modules["jointbench.rig.library"] is sys.modules["bench.rig.library"]
assert bench.rig.library.__spec__.name == "bench.rig.library"
assert jointbench.Rig is bench.Rig and Harmonic is bench.signals.Harmonic
from jointbench import *
assert sdof_rig is bench.sdof_rig
"""
ENVIRONMENT = """
import sys
{first}
import jointbench._gymnasium
import gymnasium
assert "bench" not in sys.modules
environment = gymnasium.make("JointBench/SDOFExcitation-v0").unwrapped
assert type(environment).__module__ == "{module}.single"
import {module}.single
assert type(environment) is {module}.single.SDOFExcitationEnv
import jointbench.envs.single
assert sys.modules["jointbench.envs.single"] is sys.modules["{module}.single"]
{last}
"""
MISSING = """
import jointbench
for wrong in ("import jointbench.nonsense", "jointbench.nonsense", "from jointbench import nonsense"):
    try:
        exec(wrong)
    except (ImportError, AttributeError) as error:
        print(type(error).__name__, error)
"""


def run(code: str, folder: Path, *more: Path) -> subprocess.CompletedProcess[str]:
    paths = [ROOT / "bench" / "_facade", *more]
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def occupied(tmp_path):
    for name in ("bench", "envs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("MINE = True\n")
    return tmp_path


@pytest.mark.parametrize("own_folders", [False, True])
def test_names_and_packages_are_those_of_bench(own_folders, tmp_path, request):
    told = run(ALIASES, request.getfixturevalue("occupied") if own_folders else tmp_path)
    assert told.returncode == 0, told.stderr


@pytest.mark.slow
def test_environments_are_made_without_an_import(tmp_path):
    told = run(ENVIRONMENT.format(first="", module="envs", last=""), tmp_path, ROOT)
    assert told.returncode == 0, told.stderr


@pytest.mark.slow
@pytest.mark.parametrize("first", ["", "import envs"])
def test_environments_are_made_beside_the_users_own(first, occupied):
    last = "import envs\nassert envs.MINE"
    told = run(ENVIRONMENT.format(first=first, module="jointbench.envs", last=last), occupied)
    assert told.returncode == 0, told.stderr


def test_a_foreign_bench_that_came_first_is_named(occupied):
    told = run("import bench, jointbench\njointbench.Rig", occupied)
    assert f"called 'bench' is imported already ({occupied / 'bench' / '__init__.py'})" in told.stderr


def test_names_that_do_not_exist(tmp_path):
    told = run(MISSING, tmp_path)
    assert told.stdout.splitlines() == [
        "ModuleNotFoundError No module named 'jointbench.nonsense'",
        "AttributeError module 'jointbench' has no attribute 'nonsense'",
        f"ImportError cannot import name 'nonsense' from 'jointbench' ({ROOT}/bench/_facade/jointbench/__init__.py)",
    ]


def test_registered_without_import_are_all_environments():
    code = "import jointbench._gymnasium as g; import gymnasium; print(*g.IDS, len(set(g.IDS) & set(gymnasium.registry)))"
    told = run(code, ROOT.parent)
    assert told.stdout.split() == [*envs.IDS, str(len(envs.IDS))]
    assert bench.__file__ == str(ROOT / "bench" / "__init__.py")
