"""Public records of robots, diagnosed against their public models.

    python scripts/robots.py --data FOLDER                 FOLDER holds so101, ur10, tx40, … (formats: their own READMEs)
    python scripts/robots.py UR10 TX40 --data FOLDER
    python scripts/robots.py --data FOLDER --picture docs/pictures/robots.png

A row for every robot: the discrepancy (NRMSE of free runs of the judging records, worst joint) of the model as stated, what is named
with the share that it closes, what is left, the noise floor, and seconds of the processor. Nothing is tuned to them; a robot that is
refused has a row that says why.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from robot_records.case_folders import Records, write_folder  # noqa: E402
from robot_records.free_run_errors import errors_of  # noqa: E402
from robot_records.picture import draw, trace  # noqa: E402
from robot_records.robots import ROBOTS  # noqa: E402

from bench.discrepancy import read_case  # noqa: E402
from bench.discrepancy.application.applying import Findings  # noqa: E402
from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis, diagnose_articulated  # noqa: E402
from bench.discrepancy.articulated_search.problem import ArticulatedProblem  # noqa: E402
from bench.discrepancy.replay.verification import replay_of, together  # noqa: E402
from bench.errors import BenchError, UnknownNameError  # noqa: E402
from bench.files import json_values, write_text  # noqa: E402


@dataclass
class Args:
    """Diagnose public records of robots."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Robots; all where none is named."""
    data: Path = Path("robots")
    """Folder of the records."""
    out: Path | None = None
    """Folder for the rows, one JSON file each; a robot that has one there is not diagnosed again."""
    picture: Path | None = None
    """File for a picture of what is measured, of the models and of what was named (.png, .svg, .pdf)."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Row:
    """One robot.

    Attributes:
        robot: Its name.
        verdict: "effect", "none", "unknown", or why it was refused.
        named: "effect (place)" to the share of the discrepancy that it closes.
        parameters: "effect (place)" to its parameters.
        before, after, floor: NRMSE of the worst joint as stated, with what is named, and what noise alone leaves.
        joints: Joint to before, after and floor.
        complete: Whether nothing more is missing.
        seconds: Processor time [s].
        known: What is published.
        nominal: Nominal parameters as re-estimated.
        trace: What is drawn, see `robot_records.picture.trace`.
        together: Joint to before and after while all joints are free at once; empty where the model is refused by `jointbench apply`.
        further: Joint to the RMS errors [rad, m] of free runs of records that nothing was learned from, as stated and with what is named, a
            pair for every record.
    """

    robot: str
    verdict: str
    named: dict[str, float]
    parameters: dict[str, dict[str, float]]
    before: float
    after: float
    floor: float
    joints: dict[str, tuple[float, float, float]]
    complete: bool
    seconds: float
    known: str
    nominal: dict[str, float] = field(default_factory=dict)
    trace: dict[str, Any] = field(default_factory=dict)
    together: dict[str, tuple[float, float]] = field(default_factory=dict)
    further: dict[str, list[tuple[float, float]]] = field(default_factory=dict)


def row_of(name: str, data: Path, progress: Callable[[str], None] = lambda text: None) -> Row:
    """Diagnose one robot; `progress` is called with a line of text at every stage."""
    records = ROBOTS[name](data)
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        write_folder(records, Path(folder))
        try:
            case = read_case(folder)
            found = diagnose_articulated(case, anyway=True, most=records.most, progress=progress)
        except BenchError as error:
            nan = float("nan")
            return Row(
                name, str(error), {}, {}, nan, nan, nan, {}, False, time.process_time() - began, records.known
            )
        seconds, verdict = time.process_time() - began, found.verdict
        whole = _together(found, Path(folder))
        further = _further(records, found) if records.further else {}
    labels = [f"{e.name} ({e.where})" for e in verdict.named]
    return Row(
        name, verdict.verdict, dict(zip(labels, (float(e.closed) for e in verdict.named), strict=True)),
        {label: {k: float(x.value) for k, x in e.parameters.items()} for label, e in zip(labels, verdict.named, strict=True)},
        verdict.gap.before, verdict.gap.after, verdict.gap.noise_floor,
        {g.dof: (g.before, g.after, g.noise_floor) for g in verdict.gaps}, verdict.complete, seconds,
        records.known, {one.name: one.value for one in verdict.nominal}, trace(found), whole, further,
    )  # fmt: skip


def _together(found: ArticulatedDiagnosis, folder: Path) -> dict[str, tuple[float, float]]:
    """All joints at once in plain MuJoCo, see `Row.together`."""
    case, findings = read_case(folder), Findings(found.verdict.named, found.verdict.nominal)
    path = folder / case.rig
    try:
        replay = replay_of(path, case, articulated=True, findings=findings)
        runs = together(path, findings, case, replay)
    except BenchError:
        return {}
    return {run.dof: (run.before, run.after) for run in runs}


def _further(records: Records, found: ArticulatedDiagnosis) -> dict[str, list[tuple[float, float]]]:
    """Errors in further records, see `Row.further`."""
    with tempfile.TemporaryDirectory() as folder:
        write_folder(replace(records, validation=records.further), Path(folder))
        case = read_case(folder)
        problem = ArticulatedProblem.of(case, found.model, case.validation)
        nominal = np.zeros(len(problem.nominal))
        runs = [
            errors_of(problem, h, v) for h, v in (((), nominal), (found.final.hypothesis, found.final.vector))
        ]
    return {
        joint.name: [(float(a[j]), float(b[j])) for a, b in zip(*runs, strict=True)]
        for j, joint in enumerate(problem.joints)
    }


def main(args: Args) -> None:
    """Run the command."""
    names = args.names or tuple(ROBOTS)
    for name in names:
        if name not in ROBOTS:
            raise UnknownNameError("robot", name, list(ROBOTS))
    aside, rows = Console(stderr=True), []
    for name in names:

        def tell(text: str, name: str = name) -> None:
            aside.print(f"{name}: {text}", markup=False, highlight=False)

        kept = args.out / f"{name}.json" if args.out else None
        if kept is not None and kept.is_file():
            rows.append(Row(**json.loads(kept.read_text())))
            continue
        rows.append(row_of(name, args.data, tell))
        if kept is not None:
            write_text(kept, json.dumps(json_values(asdict(rows[-1])), indent=1))
    if args.picture is not None:
        draw({row.robot: row.trace for row in rows if row.trace}, args.picture)
    if args.json:
        told = [{key: value for key, value in asdict(row).items() if key != "trace"} for row in rows]
        print(json.dumps(json_values(told), indent=1))
        return
    shown = Table("robot", "verdict", "named (share)", "before", "after", "floor", "s", "known")
    for row in rows:
        named = ", ".join(f"{k} {round(100.0 * share)} %" for k, share in row.named.items())
        numbers = [f"{x:.3g}" for x in (row.before, row.after, row.floor)]
        shown.add_row(row.robot, row.verdict, named, *numbers, f"{row.seconds:.0f}", row.known)
    console = Console(width=180)
    console.print(shown)
    for row in rows:
        for joint, pairs in row.further.items():
            before, after = (1e3 * np.median([pair[k] for pair in pairs]) for k in (0, 1))
            console.print(
                f"{row.robot}, {joint}: {before:.1f} -> {after:.1f} mrad, median over {len(pairs)} further records"
            )


if __name__ == "__main__":
    try:
        main(tyro.cli(Args))
    except BenchError as error:
        sys.exit(f"robots: {error}")
