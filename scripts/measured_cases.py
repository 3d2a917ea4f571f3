"""Measured records as a benchmark: diagnose them, and grade the verdicts by what was written down before (`measured/acceptance.json`).

    python scripts/measured_cases.py                                  the records that come with the bench
    python scripts/measured_cases.py --data FOLDER                    and the public ones in FOLDER/emps, FOLDER/silverbox, …
    python scripts/measured_cases.py --cases FOLDER                   and case folders, graded by FOLDER/acceptance.json
    python scripts/measured_cases.py --data FOLDER --peer 300         mujoco.sysid with BIC beside it, 300 s a case

Right: what is missing is named, beside nothing else, and what is left is as small as was asked for. Honest: unknown, a declared set that
holds it, or no certain name. Wrong: a certain false name, or none over an effect. Stopped, it goes on where it was; the results of
a commit are kept by its hash, and `--again` diagnoses anew.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from checkout import commit  # noqa: E402
from diagnose_measured import gather  # noqa: E402
from measured.acceptance import Acceptance, acceptance_of, acceptances  # noqa: E402

from bench.discrepancy import Case, diagnose, read_case  # noqa: E402
from bench.errors import BenchError  # noqa: E402
from bench.files import json_values, write_text  # noqa: E402


@dataclass
class Args:
    """Diagnose measured records, and grade the verdicts."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Cases, or beginnings of their names; all where none is given."""
    data: Path | None = None
    """Folder of the public records that are not shipped."""
    cases: Path | None = None
    """Folder of case folders, with an acceptance.json of its own."""
    peer: float = 0.0
    """Seconds that mujoco.sysid with BIC may take for each case; not asked where zero."""
    out: Path = ROOT / "out" / "measured"
    """Folder for the results; those of a commit lie in a folder of its own."""
    again: bool = False
    """Diagnose cases whose result is there already as well."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Row:
    """One case.

    Attributes:
        case: Its name.
        grade: "right", "honest" or "wrong"; "refused" where it should have been diagnosed; empty where nothing was
            written down.
        verdict: "effect", "none", "unknown", or why it was refused.
        named: Names with their probabilities.
        sets: Declared sets.
        before, after: Discrepancy of the judging records.
        seconds: Processor time [s].
        peer: What mujoco.sysid with BIC names; empty where it was not asked or cannot.
        peer_grade: Its grade by the same rule.
        why: What is known of the case.
    """

    case: str
    grade: str
    verdict: str
    named: dict[str, float]
    sets: list[list[str]]
    before: float | None
    after: float | None
    seconds: float
    peer: str
    peer_grade: str
    why: str


def main() -> int:
    """Diagnose, grade and print."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=True)
    results = args.out / commit()
    rows = []
    for name, load, acceptance in _wanted(args):
        kept = results / f"{name}.json"
        if args.again or not kept.exists():
            console.print(name)
            write_text(kept, json.dumps(json_values(_diagnosed(load))))
        found = json.loads(kept.read_text(encoding="utf-8"))
        if args.peer > 0.0 and "peer" not in found:
            found["peer"] = _peer(load, args.peer)
            write_text(kept, json.dumps(found))
        rows.append(_row(name, found, acceptance))
    if args.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
    else:
        Console(width=None if sys.stdout.isatty() else 160).print(table(rows))
        grades = [row.grade for row in rows]
        print(", ".join(f"{grades.count(g)} {g}" for g in ("right", "honest", "wrong")) + f" of {len(rows)}")
    return 0


def _wanted(args: Args) -> Iterator[tuple[str, Callable[[], Case], Acceptance | None]]:
    """Name of every case, what loads it, and what is right of it."""
    known = acceptances()
    for name, wanted in gather(args.data, args.names).items():
        yield name, lambda wanted=wanted: wanted.case, acceptance_of(name, known)
    if args.cases is None:
        return
    own = acceptances(args.cases / "acceptance.json")
    for folder in sorted(path.parent for path in args.cases.glob("*/nominal.json")):
        if not args.names or any(folder.name.startswith(name) for name in args.names):
            yield folder.name, lambda folder=folder: read_case(folder), acceptance_of(folder.name, own)


def _diagnosed(load: Callable[[], Case]) -> dict[str, Any]:
    began = time.process_time()
    try:
        verdict = diagnose(load()).verdict.to_json()
    except BenchError as error:
        return {"refused": str(error), "cpu_seconds": time.process_time() - began}
    return verdict | {"cpu_seconds": time.process_time() - began}


def _peer(load: Callable[[], Case], seconds: float) -> dict[str, Any]:
    """What mujoco.sysid with BIC says of a case; why it does not, where it cannot."""
    try:
        from benchmarks.peer_sysid import diagnose as sysid
    except ImportError as error:
        return {"refused": f"needs the extra 'peers': {error}"}
    case = load()
    if case.rig not in ("sdof", "joint"):
        return {"refused": "the motion is prescribed, or the model the user's own"}
    try:
        placed, _ = sysid(case, seconds=seconds)
    except (BenchError, ValueError, ArithmeticError) as error:
        return {"refused": str(error)}
    return {"named": "" if placed is None else placed.effect.name}


def _row(name: str, found: Mapping[str, Any], acceptance: Acceptance | None) -> Row:
    peer = found.get("peer", {})
    said = peer.get("named") if "named" in peer else None
    own = ""
    if acceptance is not None and said is not None:
        entry = [{"name": said, "probability": 1.0}] if said else []
        own = acceptance.grade(
            {"verdict": "effect" if said else "none", "named": entry, "gap": {"after": 0.0}}
        )
    shown = peer.get("refused", "") if said is None else said or "none"
    why = "" if acceptance is None else acceptance.why
    if "refused" in found:
        message = found["refused"]
        grade = "refused" if acceptance is None else acceptance.refused(message)
        return Row(name, grade, message, {}, [], None, None, found["cpu_seconds"], shown, own, why)
    return Row(
        name,
        "" if acceptance is None else acceptance.grade(found),
        found["verdict"],
        {
            f"{e['name']} ({e['where']})" if e.get("where") else e["name"]: e["probability"]
            for e in found["named"]
        },
        [list(entry) for entry in found["indistinguishable"]],
        found["gap"]["before"],
        found["gap"]["after"],
        found["cpu_seconds"],
        shown,
        own,
        why,
    )


def table(rows: list[Row]) -> Table:
    """The rows as a table, wrong ones and all."""
    out = Table(
        "case", "grade", "verdict", "named", "declared sets", "before", "after", "CPU [s]", "sysid + BIC"
    )
    for row in rows:
        named = ", ".join(f"{name} {p:.2f}" for name, p in row.named.items())
        sets = "; ".join(" | ".join(entry) for entry in row.sets)
        before, after = ("" if value is None else f"{value:.3g}" for value in (row.before, row.after))
        peer = f"{row.peer} ({row.peer_grade})" if row.peer_grade else row.peer
        out.add_row(row.case, row.grade, row.verdict, named, sets, before, after, f"{row.seconds:.0f}", peer)
    return out


if __name__ == "__main__":
    raise SystemExit(main())
