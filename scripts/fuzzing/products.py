"""Targets: what the bench writes and reads again (verdicts, parts of campaigns), arms, and the command line itself."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import BenchError
from fuzzing.documents import PLAN, Target, make_campaign, make_case, write
from fuzzing.models import ODD_MJCF
from fuzzing.mutations import VALUES, flipped, mutated
from fuzzing.records import spoilt_text

ARM = """<mujoco model="arm">
  <option timestep="0.002" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="upper"><joint name="shoulder" type="hinge" axis="0 1 0" damping="0.3" armature="0.02" range="-150 150"/>
      <inertial pos="0 0 -0.12" mass="1" diaginertia="0.004 0.004 0.0006"/>
      <body name="fore" pos="0 0 -0.25"><joint name="elbow" type="hinge" axis="0 1 0" damping="0.1" armature="0.02"/>
        <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.003 0.003 0.0005"/></body></body>
  </worldbody>
  <actuator>
    <position name="m1" joint="shoulder" kp="60" ctrlrange="-3 3" ctrllimited="true"/>
    <position name="m2" joint="elbow" kp="40" forcerange="-20 20"/>
  </actuator>
</mujoco>
"""
ROBOT: dict[str, Any] = {
    "rig": "arm.xml",
    "parameters": {
        "mass:upper": {"value": 1.0, "std": 0.03, "unit": "kg"},
        "damping:elbow": {"value": 0.1, "std": 0.03, "unit": "N m s/rad"},
        "kp:m2": {"value": 40.0, "std": 2.0, "unit": "N m/rad"},
    },
    "channels": {
        "time": {"unit": "s"},
        "t1": {"unit": "rad", "role": "command", "actuator": "m1", "noise_std": 0.0},
        "t2": {"unit": "deg", "role": "command", "actuator": "m2"},
        "q1": {"unit": "rad", "joint": "shoulder", "quantity": "position", "noise_std": 1e-3, "side": "link"},
        "q2": {"unit": "rad", "joint": "elbow", "quantity": "position", "resolution": 1e-3},
        "v2": {"unit": "rad/s", "joint": "elbow", "quantity": "velocity", "noise_std": 0.05},
    },
    "load_interpolation": "zero_order_hold",
}  # fmt: skip
GAP: dict[str, Any] = {
    "metric": "validation elbow position NRMSE", "before": 0.2, "parameters_only": 0.15, "after": 0.02, "noise_floor": 0.01,
    "closed": 0.9, "closed_ci95": [0.8, 0.95], "steps": [["nominal", 0.2], ["coulomb_friction", 0.02]], "dof": "elbow",
}  # fmt: skip
VERDICT: dict[str, Any] = {
    "verdict": "effect",
    "named": [
        {
            "name": "coulomb_friction", "where": "elbow", "probability": 0.97, "channel": "elbow", "equation": "limit sign(v)",
            "parameters": {"limit": {"value": 0.4, "std": 0.02, "unit": "N m"}}, "law": "", "theta": [], "closed": 0.9,
            "closed_ci95": [0.8, 0.95],
        },
        {
            "name": "mass_error", "where": "fore", "probability": 0.9, "channel": "elbow", "equation": "m",
            "parameters": {"payload": {"value": 0.2, "std": 0.02, "unit": "kg"}}, "law": "", "theta": [], "closed": 0.5,
            "closed_ci95": [0.3, 0.6],
        },
    ],
    "ranking": [{"name": "coulomb_friction", "where": "elbow", "probability": 0.97}],
    "indistinguishable": [],
    "locations": [],
    "gap": GAP,
    "gaps": [GAP],
    "probabilities": {"effect": 0.97, "none": 0.01, "unknown": 0.02},
    "explanation": "",
    "nominal": [
        {"name": "damping:elbow", "value": 0.12, "std": 0.01, "stated": 0.1, "stated_std": 0.03, "shift_in_std": 0.7}
    ],
}  # fmt: skip


def command(*arguments: str | Path) -> str:
    """Run a command line; what it printed.

    Raises:
        BenchError: It was refused, with its last line.
    """
    from bench.cli import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as stopped:  # the parser's own refusal, drawn in a box
            status, words = int(stopped.code or 0), "jointbench: arguments"
        else:
            words = (err.getvalue().splitlines() or [""])[-1]
    if status:
        assert words.startswith("jointbench: "), f"exit status {status} with {err.getvalue()[-200:]!r}"
        raise BenchError(words)
    return out.getvalue()


def make_robot(folder: Path) -> None:
    """An arm on two servos."""
    import mujoco

    (folder / "arm.xml").write_text(ARM)
    write(folder / "nominal.json", ROBOT)
    model = mujoco.MjModel.from_xml_string(ARM)
    for name, pitch in (("identification", 1.0), ("validation", 1.3)):
        data, rows = mujoco.MjData(model), []
        for k in range(300):
            time = 0.01 * k
            data.ctrl[:] = 0.4 * np.sin(pitch * 3.0 * time), 0.5 * np.sin(pitch * 4.0 * time)
            rows.append([time, data.ctrl[0], np.degrees(data.ctrl[1]), *data.qpos, data.qvel[1]])
            mujoco.mj_step(model, data, 5)
        heading = "time,t1,t2,q1,q2,v2"
        np.savetxt(
            folder / f"{name}.csv", np.array(rows), delimiter=",", header=heading, comments="", fmt="%.7g"
        )


def _spoil_model(path: Path, rng: np.random.Generator) -> None:
    lines = path.read_text().split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        if rng.random() < 0.3:
            lines.insert(at, str(rng.choice(ODD_MJCF)).replace("model.xml", path.name))
        else:
            k = int(rng.integers(max(len(lines[at]), 1)))
            odd = str(rng.choice(["", "-", "9" * 30, "nan", '"', "<", "1e308", "x", "0"]))
            lines[at] = lines[at][:k] + odd + lines[at][k + int(rng.integers(4)) :]
    path.write_text("\n".join(lines))


def _spoil_json(path: Path, rng: np.random.Generator) -> None:
    path.write_text(mutated(json.loads(path.read_text()), rng), encoding="utf-8", errors="surrogatepass")


def spoil_robot(folder: Path, rng: np.random.Generator) -> None:
    """Spoil the model, nominal.json or a record."""
    chance = rng.random()
    if chance < 0.4:
        _spoil_model(folder / "arm.xml", rng)
    elif chance < 0.8:
        _spoil_json(folder / "nominal.json", rng)
    else:
        path = folder / "identification.csv"
        path.write_bytes(spoilt_text(path.read_text(), rng).encode("utf-8", "surrogatepass"))


def read_robot(folder: Path) -> None:
    """Admit the case to the diagnosis, by the engine that it is for."""
    from bench.discrepancy.articulated.admission import admitted_robot
    from bench.discrepancy.articulated.recognition import applies
    from bench.discrepancy.case.reading import read_case
    from bench.discrepancy.checks.admission import admitted

    case = read_case(folder)
    with np.errstate(all="ignore"):
        (admitted_robot if applies(case) else admitted)(case)


def make_applied(folder: Path) -> None:
    """A verdict on the arm."""
    make_robot(folder)
    write(folder / "verdict.json", VERDICT)


def spoil_applied(folder: Path, rng: np.random.Generator) -> None:
    """Spoil the verdict or the model."""
    if rng.random() < 0.7:
        _spoil_json(folder / "verdict.json", rng)
    else:
        _spoil_model(folder / "arm.xml", rng)


def read_applied(folder: Path) -> None:
    """Apply it; nothing may be there where it is refused, and nothing half where it is not."""
    out = folder / "out"
    try:
        command(
            "apply", folder / "verdict.json", "--model", folder / "arm.xml", "-o", out / "new.xml", "--json", out / "told.json",
            "--case", folder,
        )  # fmt: skip
    finally:
        if (out / "told.json").exists():
            json.loads((out / "told.json").read_text())
            shutil.rmtree(out)


def spoil_parts(folder: Path, rng: np.random.Generator) -> None:
    """Change, tear, swap, rename or remove files of a campaign."""
    files = sorted(path for path in (folder / "campaign").rglob("*") if path.is_file())
    for _ in range(int(rng.integers(1, 3))):
        path, other = (files[int(i)] for i in rng.integers(len(files), size=2))
        action = int(rng.integers(5))
        if not (path.exists() and other.exists()):
            continue
        content = path.read_bytes()
        if action == 0:
            path.write_bytes(flipped(content, rng))
        elif action == 1:
            path.write_bytes(content[: int(rng.integers(len(content) + 1))])
        elif action == 2:
            path.write_bytes(other.read_bytes())
        elif action == 3:
            path.rename(
                path.with_name(str(rng.choice(["part-000009.parquet", "x.txt", ".hidden", path.name + "~"])))
            )
        else:
            path.unlink()


def read_parts(folder: Path) -> None:
    """Verify, read, resume: what a resume calls finished is what an undisturbed run wrote."""
    from bench.campaign import Windows, run_campaign, verify

    at = folder / "campaign"
    for use in (verify, lambda place: list(Windows(place, 10))):
        with contextlib.suppress(BenchError):
            use(at)
    run_campaign(PLAN, at)
    assert verify(at) == [], f"a resume left {verify(at)}"


WORDS = (
    "0",
    "-1",
    "1e999",
    "nan",
    "x",
    "",
    "9" * 400,
    "../..",
    "\u202e",
    "--json",
    "-",
    "/dev/null",
    "/proc/self/mem",
    "case",
    "a" * 5000,
)
LINES: tuple[tuple[str, ...], ...] = (
    ("schema", "rig", "-o", "OUT"), ("schema", "--list", "--json"), ("schema", "plan", "--force"),
    ("diagnose", "nowhere", "--budget", "3", "--most", "2"), ("diagnose", "case", "--budget", "0", "--json", "OUT"),
    ("diagnose", "case", "--html", "OUT", "--most", "0"),
    ("blind", "score", "case", "case", "--markdown", "OUT"), ("blind", "run", "nowhere", "OUT"),
    ("blind", "make", "OUT", "OUT", "--n", "0"),
    ("laws", "--json"), ("campaign", "case/nominal.json", "--out", "OUT"),
    ("apply", "case/nominal.json", "--model", "case/nominal.json", "-o", "OUT"),
    ("simulate", "case/nominal.json", "--out", "OUT"), ("excite", "case/nominal.json", "--json", "OUT"),
)  # fmt: skip


def spoil_line(folder: Path, rng: np.random.Generator) -> None:
    """A command line with words changed, left out or added."""
    line = list(LINES[int(rng.integers(len(LINES)))])
    for _ in range(int(rng.integers(1, 3))):
        at = int(rng.integers(1, len(line) + 1))
        odd = str(VALUES[int(rng.integers(len(VALUES)))]) if rng.random() < 0.3 else str(rng.choice(WORDS))
        if rng.random() < 0.7 and at < len(line):
            line[at] = odd
        else:
            line.insert(at, odd)
    write(folder / "line.json", line)


def read_line(folder: Path) -> None:
    """Run it in the folder; only what it was asked to write may be there afterwards."""
    line = json.loads((folder / "line.json").read_text())
    before = set(folder.rglob("*"))
    with contextlib.chdir(folder):
        try:
            command(*line)
        finally:
            asked = {Path(word).resolve() for word in line if "\x00" not in word and len(word) < 200}
            for path in sorted(set(folder.rglob("*")) - before):
                if path.resolve() in asked or asked & {parent.resolve() for parent in path.parents} - {
                    folder.resolve()
                }:
                    path.unlink() if path.is_file() else None


def _make_line(folder: Path) -> None:
    (folder / "case").mkdir()
    make_case(folder / "case")
    # what takes long before anything is read, imports and a first compilation, is over once this has run
    import bench.discrepancy.application.applying  # noqa: F401

    write(folder / "line.json", ["diagnose", "case", "--budget", "0.001", "--json", "OUT"])


PRODUCT_TARGETS: dict[str, Target] = {
    "robot": Target(make_robot, spoil_robot, read_robot),
    "apply": Target(make_applied, spoil_applied, read_applied),
    "parts": Target(make_campaign, spoil_parts, read_parts),
    "command": Target(_make_line, spoil_line, read_line),
}
"""Targets by name."""
