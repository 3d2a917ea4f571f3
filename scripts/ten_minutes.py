"""Ten minutes from a log to a corrected model: the commands a user gives, timed, in at most three for each machine.

    python scripts/ten_minutes.py [--only mismatch arm pendulum so101] [--robots FOLDER] [--json]

The stage of `examples/mismatch` and the arm of `examples/arm` come as case folders, a servo with friction as two CSV logs and an MJCF, the
SO-101 arm, where FOLDER holds `so101/model.xml` and `so101/motions/*.parquet`, as logs in Parquet. What makes the records stands for the
laboratory and is not counted. Printed are the commands with their seconds, what was named, and what it is worth in plain MuJoCo; the
exit status is 1 where a machine takes more than ten minutes, more than three commands, or ends without a corrected model that is nearer to
the records than the one it came with.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
LIMIT, MOST = 600.0, 3
"""Seconds and commands a machine may take."""
SO101_JOINTS = {
    "Rotation": "shoulder_pan", "Pitch": "shoulder_lift", "Elbow": "elbow_flex", "Wrist_Pitch": "wrist_flex", "Wrist_Roll": "wrist_roll",
    "Jaw": "gripper",
}  # fmt: skip
"""What the SO-101's log calls its joints, and what its model does."""
SO101 = ("chirp_sweep", "friction_gravity", "prbs_excitation")
"""Motions of the SO-101 arm, the last one judging."""


def example(name: str) -> Callable[[Path], list[list[str]]]:
    """Commands for an example that comes as a case folder."""

    def commands(folder: Path) -> list[list[str]]:
        case = folder / "case"
        subprocess.run(
            [sys.executable, str(ROOT / "examples" / name / "measure.py"), str(case)], check=True, stdout=subprocess.DEVNULL
        )  # fmt: skip
        return _from_case(case, folder)

    return commands


def _from_case(case: Path, folder: Path) -> list[list[str]]:
    rig = json.loads((case / "nominal.json").read_text())["rig"]
    return [
        ["diagnose", str(case), "--json", str(case / "verdict.json"), "--html", str(folder / "report.html"), "--no-progress"],
        _apply(case, rig, folder),
    ]  # fmt: skip


def _apply(case: Path, rig: str, folder: Path) -> list[str]:
    return [
        "apply", str(case / "verdict.json"), "--model", str(case / rig), "--nearest", "-o", str(folder / "corrected.xml"),
        "--json", str(folder / "applied.json"),
    ]  # fmt: skip


def _from_logs(
    logs: list[Path], model: Path, folder: Path, more: list[str], *, budget: float | None = None
) -> list[list[str]]:
    case = folder / "case"
    first = ["init", *map(str, logs), str(model), "-o", str(case), *more]
    diagnose = ["diagnose", str(case), "--json", str(case / "verdict.json"), "--no-progress"]
    diagnose += [] if budget is None else ["--budget", f"{budget:g}"]
    return [first, diagnose, _apply(case, model.name, folder)]


def pendulum(folder: Path) -> list[list[str]]:
    """Commands for logs of a servo whose model lacks friction."""
    from native_effects import EFFECTS, MODELS, RECORDS, measure

    logs = folder / "logs"
    logs.mkdir()
    native = EFFECTS["frictionloss of a servo"]
    measure(logs, MODELS[native.model], native.change)
    columns = [
        "--map",
        "command=elbow.command",
        "position=elbow.position",
        "--unit",
        "command=rad",
        "position=rad",
    ]
    return _from_logs([logs / f"{name}.csv" for name in RECORDS], logs / "model.xml", folder, columns)


def so101(folder: Path, robots: Path) -> list[list[str]]:
    """Commands for logs of the SO-101 arm."""
    home = robots / "so101"
    columns = [
        f"{quantity}_{label}={joint}.{quantity}"
        for label, joint in SO101_JOINTS.items()
        for quantity in ("command", "position")
    ]
    logs = [home / "motions" / f"{name}.parquet" for name in SO101]
    # five servos of a model whose gains are fifty times too stiff: the search would go on for longer than there is
    return _from_logs(logs, home / "model.xml", folder, ["--map", *columns], budget=0.5 * LIMIT)


def attempt(name: str, commands: list[list[str]], folder: Path) -> dict[str, Any]:
    """Run the commands of a machine."""
    steps: list[dict[str, Any]] = []
    for command in commands:
        began = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "bench.cli", *command],
            capture_output=True,
            text=True,
            cwd=ROOT,
            check=False,
        )
        steps.append(
            {
                "command": f"jointbench {' '.join(command)}",
                "seconds": time.perf_counter() - began,
                "status": done.returncode,
            }
        )
        if done.returncode != 0:
            steps[-1]["error"] = done.stderr.strip().splitlines()[-3:]
            break
    row: dict[str, Any] = {"machine": name, "steps": steps, "seconds": sum(step["seconds"] for step in steps)}
    applied = folder / "applied.json"
    if applied.is_file():
        document = json.loads(applied.read_text())
        row |= {
            "verdict": document["verdict"], "named": [f"{e['name']} ({e['where']})" for e in document["named"]],
            "line": document["applied"].get("line", ""), "remedy": document["applied"].get("remedy", ""),
        }  # fmt: skip
        figures = document["applied"].get("figures", [])
        widest = max(figures, key=lambda f: f["before"] / max(f["floor"] or 0.0, 1e-12), default=None)
        row["nearer"] = widest is not None and widest["after"] < widest["before"]
    within = row["seconds"] <= LIMIT and len(steps) <= MOST
    row["held"] = (folder / "corrected.xml").is_file() and within and row.get("nearer", False)
    return row


def told(row: dict[str, Any]) -> str:
    """A machine in some lines."""
    lines = [f"{row['machine']}: {row['seconds']:.0f} s, {'held' if row['held'] else 'not held'}"]
    for step in row["steps"]:
        lines.append(f"  {step['seconds']:6.1f} s  {step['command']}")
        lines += [f"    {line}" for line in step.get("error", ())]
    if "verdict" in row:
        lines.append(f"  {row['verdict']}: {', '.join(row['named'])}; {row['line']}")
    if row.get("remedy"):
        lines.append(f"  {row['remedy']}")
    return "\n".join(lines)


def main() -> None:
    """Print what it takes."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    machines: dict[str, Callable[[Path], list[list[str]]]] = {
        "mismatch": example("mismatch"), "arm": example("arm"), "pendulum": pendulum,
    }  # fmt: skip
    parser.add_argument("--only", nargs="*", choices=[*machines, "so101"], default=None)
    parser.add_argument(
        "--robots", type=Path, help="folder of robots' records; SO-101 is left out without it"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    asked = parser.parse_args()
    if asked.robots is not None:
        robots = asked.robots.resolve()
        machines["so101"] = lambda folder: so101(folder, robots)
    rows = []
    for name in machines if asked.only is None else asked.only:
        if name not in machines:
            parser.error(f"{name} needs --robots FOLDER")
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            rows.append(attempt(name, machines[name](folder), folder))
        if not asked.json:
            print(told(rows[-1]), flush=True)
    if asked.json:
        print(json.dumps(rows, indent=1))
    sys.exit(not all(row["held"] for row in rows))


if __name__ == "__main__":
    main()
