"""The wheel: built, installed in an empty environment, and used from there."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
USE = """
import json, pathlib, subprocess, sys
import numpy as np
import bench
assert "site-packages" in bench.__file__, bench.__file__
assert bench.model_path("joint").parent.name == "_models"
rig = bench.sdof_rig(bench.Element.of("gap", "carriage", stiffness=3000.0, clearance=0.005), mass=2.0)
record = bench.simulate(rig, {"shaker": np.full(500, 10.0)})
assert record["carriage.gap/force"].max() > 0.0
from bench.data import friction_damper_names
assert len(friction_damper_names()) == 8
from bench.examples import copy_example
assert pathlib.Path("stage/stage.xml") in copy_example("mismatch", "stage")
assert "torch" not in sys.modules
import jointbench
assert jointbench.Rig is bench.Rig
"""
MAKE = """
import gymnasium
environment = gymnasium.make("JointBench/SDOFExcitation-v0")
environment.reset(seed=0)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return next(out.glob("*.whl"))


@pytest.mark.slow
def test_wheel_holds_code_models_data_and_licences_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {
        "bench",
        "envs",
        "jointbench",
        "jointbench_gymnasium.pth",
    }
    for expected in (
        "bench/_models/sdof.xml",
        "bench/_models/assets/apparatus.xml",
        "bench/_data/friction_damper/ATTRIBUTION.md",
        "bench/_data/friction_damper/LICENSE-CC-BY-SA-4.0.txt",
        "bench/_data/friction_damper/1Hz_80lb.parquet",
        "bench/_data/published_network.json",
        "jointbench/__init__.py",
        "bench/_data/schemas/nominal.json",
        "bench/_examples/mismatch/measure.py",
    ):
        assert expected in names
    assert not [name for name in names if "_facade" in name]
    assert not [name for name in names if "__pycache__" in name or name.endswith((".nbi", ".nbc", ".so"))]
    metadata = zipfile.ZipFile(wheel).read(next(name for name in names if name.endswith("METADATA"))).decode()
    core = [
        line for line in metadata.splitlines() if line.startswith("Requires-Dist") and "extra ==" not in line
    ]
    assert not [line for line in core if "torch" in line or "stable" in line]


def needed(requirements: list[str]) -> set[str]:
    """Names of the distributions that some requirements bring, and those that these bring."""
    found: set[str] = set()
    asked = [(Requirement(text), "") for text in requirements]
    while asked:
        requirement, extra = asked.pop()
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        name = canonicalize_name(requirement.name)
        if name in found and not requirement.extras:
            continue
        found.add(name)
        own = [Requirement(text) for text in distribution(name).requires or ()]
        asked += [(one, of) for one in own for of in ("", *requirement.extras)]
    return found


def link(names: set[str], folder: Path) -> None:
    """Put what is installed here of some distributions, and nothing else, into another environment."""
    here = Path(sysconfig.get_path("purelib"))
    for name in names:
        for top in {file.parts[0] for file in distribution(name).files or () if file.parts[0] != ".."}:
            if top != "__pycache__" and not (folder / top).exists():
                (folder / top).symlink_to(here / top)


@pytest.mark.slow
def test_wheel_works_with_its_stated_requirements_alone(wheel, tmp_path):
    environment = tmp_path / "venv"
    venv.create(environment)
    python = environment / "bin" / "python"
    metadata = (
        zipfile.ZipFile(wheel).read(f"{'-'.join(wheel.name.split('-')[:2])}.dist-info/METADATA").decode()
    )
    stated = [line.partition(": ")[2] for line in metadata.splitlines() if line.startswith("Requires-Dist")]
    link(needed(stated), next(environment.glob("lib/python*/site-packages")))
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile", "--no-deps"]
    subprocess.run([*pip, str(wheel)], check=True, capture_output=True)
    for own in ("bench", "envs"):  # a user's folders, which `python -c` has first on its path
        (tmp_path / "work" / own).mkdir(parents=True)
        (tmp_path / "work" / own / "__init__.py").touch()
    subprocess.run([python, "-c", USE], check=True, cwd=tmp_path)
    subprocess.run([python, "-c", MAKE], check=True, cwd=tmp_path)
    subprocess.run([python, "-c", MAKE], check=True, cwd=tmp_path / "work")
    laws = subprocess.run(
        [environment / "bin" / "jointbench", "laws", "--json"],
        check=True,
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert '"bouc_wen"' in laws.stdout
