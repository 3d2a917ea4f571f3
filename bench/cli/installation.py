"""Commands on the installation: examples to begin with, and what is there and what is missing."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from bench.cli.console import emit

CORE = ("mujoco", "gymnasium", "numpy", "scipy", "numba", "rerun-sdk", "matplotlib", "pyarrow", "pydantic")
EXTRAS = {
    "rl": ("stable-baselines3", "torch", "cmaes", "minari"),
    "scale": ("distributed",),
    "io": ("h5py",),
}
"""Distributions of the core, and of the extras that a command may ask for."""


@dataclass
class Example:
    """Copy an example that comes with the bench to where you can change it.

    jointbench example mismatch my-stage
    """

    name: tyro.conf.Positional[str] = ""
    """Name of the example; without one, all are listed."""
    target: tyro.conf.Positional[Path | None] = None
    """Folder or file to write; the example's own name by default."""
    force: bool = False
    """Overwrite files that exist."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.examples import copy_example, example_names

        if not self.name:
            names = {name: "folder" if path.is_dir() else "file" for name, path in example_names().items()}
            if self.json:
                emit([{"name": name, "kind": kind} for name, kind in names.items()])
            else:
                print("\n".join(f"{name}  ({kind})" for name, kind in names.items()))
            return
        files = copy_example(self.name, self.target, force=self.force)
        if self.json:
            emit({"files": [str(path) for path in files]})
        else:
            print("\n".join(f"wrote {path}" for path in files))


@dataclass
class Doctor:
    """Print versions, where compiled code is kept, whether pictures can be rendered, and what is missing."""

    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        rows = [*_machine(), *_packages(), *_callback(), *_rendering()]
        if self.json:
            emit([{"what": what, "found": found, "advice": advice} for what, found, advice in rows])
            return
        table = Table("", "found", "what to do")
        for what, found, advice in rows:
            table.add_row(what, Text(found), Text(advice))
        Console().print(table)


CheckRow = tuple[str, str, str]
"""What, what was found, and what to do about it (empty: nothing)."""


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _machine() -> list[CheckRow]:
    import bench
    from bench.kernel_cache import place

    return [
        ("jointbench", bench.__version__, ""),
        ("python", f"{platform.python_version()} on {platform.system()} {platform.machine()}", ""),
        ("processors", str(os.cpu_count()), ""),
        ("compiled laws", place(Path(bench.__file__).parent), ""),
    ]


def _packages() -> list[CheckRow]:
    rows = [(name, _installed(name) or "missing", "") for name in CORE]
    rows = [
        (name, found, "pip install --force-reinstall jointbench" if found == "missing" else "")
        for name, found, _ in rows
    ]
    for extra, names in EXTRAS.items():
        missing = [name for name in names if _installed(name) is None]
        found = "complete" if not missing else f"without {', '.join(missing)}"
        rows.append(
            (f"extra {extra}", found, f"pip install 'jointbench[{extra}]' if you need it" if missing else "")
        )
    return rows


def _callback() -> list[CheckRow]:
    """Whether a rig runs, with its forces: MuJoCo's structs are those that the callback was tested with."""
    import time

    import numpy as np

    from bench import Element, sdof_rig, simulate
    from bench.errors import BenchError

    begun = time.perf_counter()
    try:
        record = simulate(sdof_rig(Element.of("gap", "carriage")), {"shaker": np.full(200, 10.0)})
    except BenchError as error:
        return [("native forces", "do not run", str(error))]
    seconds = time.perf_counter() - begun
    if not np.any(record["carriage.gap/force"]) and not np.any(record["displacement"]):
        return [("native forces", "run, but do nothing", "report it with this table")]
    return [("native forces", f"run ({seconds:.1f} s, compilation included)", "")]


def _rendering() -> list[CheckRow]:
    """Whether MuJoCo can draw here; a process of its own, since a missing driver may end it."""
    import subprocess

    test = (
        "import mujoco; m = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size=\"1\"/></worldbody></mujoco>');"
        "r = mujoco.Renderer(m, 32, 32); r.update_scene(mujoco.MjData(m)); r.render()"
    )
    backends = [os.environ["MUJOCO_GL"]] if os.environ.get("MUJOCO_GL") else ["", "egl", "osmesa"]
    for backend in backends:
        setting = {"MUJOCO_GL": backend} if backend else {}
        done = subprocess.run(
            [sys.executable, "-c", test],
            env=os.environ | setting,
            capture_output=True,
            check=False,
            timeout=60,
        )
        if done.returncode == 0:
            name = backend or "MuJoCo's own choice"
            return [
                (
                    "rendering",
                    f"works ({name})",
                    f"export MUJOCO_GL={backend}" if setting and len(backends) > 1 else "",
                )
            ]
    return [
        (
            "rendering",
            "no driver",
            "install EGL (Debian: libegl1 libgl1-mesa-dri) and export MUJOCO_GL=egl; only pictures of rigs need it",
        )
    ]
