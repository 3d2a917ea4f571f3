"""Benchmarks of jointbench, every row a ratio against a peer or a limit, run side by side.

python scripts/benchmark.py native stream --save out.json
python scripts/benchmark.py diagnosis --data FOLDER --rig joint
python scripts/benchmark.py --compare before.json after.json
"""

from __future__ import annotations

import importlib
import inspect
import json
import os
import platform
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent))

from benchmarks.timing import Row

from bench.files import write_text

GROUPS = tuple(
    sorted(
        path.stem
        for path in (Path(__file__).parent / "benchmarks").glob("[a-z]*.py")
        if "\ndef rows(" in path.read_text(encoding="utf-8")
    )
)
"""Files that make rows; the others are what these are made of."""


@dataclass
class Args:
    """Run groups of benchmarks.

    Attributes:
        groups: Groups to run; all where none is named.
        repeats: Interleaved repeats of each comparison.
        json: Print JSON instead of a table.
        save: File the results are written to as JSON.
        compare: Two saved files to compare instead of running.
        full: More and longer cases, for the groups that draw cases.
        data: Folder of cases with their answers, for the groups that draw cases, in place of drawn ones.
        rig: Rig whose cases of that folder are run: sdof or joint.
        work: Folder that keeps what is done, for the groups that take long: the same command goes on from there.
    """

    groups: tyro.conf.Positional[tuple[str, ...]] = ()
    repeats: int = 15
    json: bool = False
    save: Path | None = None
    compare: Annotated[tuple[Path, Path] | None, tyro.conf.arg(metavar="A B")] = field(default=None)
    full: bool = False
    data: Path | None = None
    rig: Literal["sdof", "joint"] = "sdof"
    work: Path | None = None


def main() -> int:
    """Run, print, save; exit status 1 where a limit does not hold."""
    args = tyro.cli(Args, description=__doc__)
    if args.compare is not None:
        _compare(*args.compare)
        return 0
    unknown = set(args.groups) - set(GROUPS)
    if unknown:
        print(f"unknown group(s) {sorted(unknown)}; known: {', '.join(GROUPS)}", file=sys.stderr)
        return 2
    document: dict[str, Any] = {"machine": machine(), "repeats": args.repeats, "groups": {}}
    console = Console(stderr=args.json)
    holds = True
    for group in args.groups or GROUPS:
        with console.status(f"running {group}") as status:
            run = importlib.import_module(f"benchmarks.{group}").rows
            taken = inspect.signature(run).parameters
            settings: dict[str, Any] = {
                "full": args.full,
                "data": args.data,
                "rig": args.rig,
                "work": args.work,
            }
            settings["progress"] = status.update
            rows: list[Row] = run(args.repeats, **{k: v for k, v in settings.items() if k in taken})
        document["groups"][group] = [row.to_dict() for row in rows]
        holds &= all(row.holds is not False for row in rows)
        if not args.json:
            console.print(_table(group, rows))
    text = json.dumps(document, indent=1, ensure_ascii=False)
    if args.json:
        print(text)
    if args.save is not None:
        write_text(args.save, text)
    return 0 if holds else 1


def machine() -> dict[str, Any]:
    """What the figures depend on."""
    return {"cores": os.cpu_count(), "python": platform.python_version(), "numpy": np.__version__}


def _table(group: str, rows: list[Row]) -> Table:
    table = Table(title=f"benchmark {group}")
    for column in ("comparison", "ratio", "10–90 %", "limit", "holds", "what the ratio is"):
        table.add_column(column)
    for row in rows:
        mark = {True: "yes", False: "[red]no[/red]", None: ""}[row.holds]
        table.add_row(
            row.name,
            f"{row.ratio:.3g}",
            f"{row.spread[0]:.3g}–{row.spread[1]:.3g}",
            row.limit,
            mark,
            row.meaning,
        )
    return table


def _compare(before: Path, after: Path) -> None:
    old, new = (json.loads(path.read_text(encoding="utf-8"))["groups"] for path in (before, after))
    table = Table(title=f"{before.name} → {after.name}")
    for column in ("group", "comparison", "before", "after"):
        table.add_column(column)
    for group, rows in new.items():
        past = {row["name"]: row["ratio"] for row in old.get(group, [])}
        for row in rows:
            known = f"{past[row['name']]:.3g}" if row["name"] in past else "–"
            table.add_row(group, row["name"], known, f"{row['ratio']:.3g}")
    Console().print(table)


if __name__ == "__main__":
    sys.exit(main())
