"""The joint with memory against polynomial, network, Bouc-Wen, NARX and LSTM: the figures of docs/memory-joint.md.

    python scripts/memory_joint.py                       all tasks that need no further data
    python scripts/memory_joint.py --data FOLDER         also the Bouc-Wen benchmark (FOLDER/bouc_wen_benchmark)
    python scripts/memory_joint.py laboratory damper     only these

What a task gave is kept in the output folder and read from there the next time (`--fresh` computes it anew), so that a run that was
stopped goes on where it was.
"""

from __future__ import annotations

import importlib
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from memory.row import Row
from rich.console import Console
from rich.table import Table

from bench.errors import BenchError
from bench.files import write_text

TASKS = ("laboratory", "damper", "benchmark", "chain", "passivity", "speed")


@dataclass
class Args:
    """Compare joints with memory with their rivals."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Tasks; all where none is named."""
    data: Path | None = None
    """Folder of the measured records that are not shipped."""
    out: Path = Path("out/memory_joint")
    """Folder that results are kept in."""
    fresh: bool = False
    """Compute what is kept anew."""
    json: bool = False
    """Print JSON."""


def task_rows(name: str, args: Args, console: Console) -> list[dict[str, Any]]:
    """Rows of a task, kept or computed; none where its data are not there."""
    kept = args.out / f"{name}.json"
    if kept.exists() and not args.fresh:
        return json.loads(kept.read_text(encoding="utf-8"))
    module = importlib.import_module(f"memory.{name}")
    given: tuple[Path, ...] = ()
    if name == "benchmark":
        folder = None if args.data is None else args.data / "bouc_wen_benchmark"
        if folder is None or not folder.is_dir():
            console.print(f"{name}: left out, its data are not shipped; give --data FOLDER")
            return []
        given = (folder,)
    rows: list[Row] = module.rows(lambda text: console.print(f"{name}: {text}"), *given)
    values = [row.to_dict() for row in rows]
    args.out.mkdir(parents=True, exist_ok=True)
    write_text(kept, json.dumps(values, indent=1, ensure_ascii=False) + "\n")
    return values


def table(rows: list[dict[str, Any]]) -> Table:
    """Rows as a table."""
    out = Table("task", "model", "quantity", "figure", "limit", "holds", "note")
    for row in rows:
        value = math.inf if row["value"] is None else row["value"]
        figure = (
            "diverges"
            if row["value"] is None
            else f"{value:.3g}" + ("" if row["unit"] == "1" else f" {row['unit']}")
        )
        limit = "" if row["limit"] is None else f"{'≥' if row['least'] else '≤'} {row['limit']:.3g}"
        holds = {None: "", True: "yes", False: "no"}[row["holds"]]
        out.add_row(row["task"], row["model"], row["quantity"], figure, limit, holds, row["note"])
    return out


def main() -> int:
    """Run, print; 1 where a limit does not hold."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=True)
    unknown = sorted(set(args.names) - set(TASKS))
    if unknown:
        console.print(
            f"unknown task {', '.join(unknown)}; known: {', '.join(TASKS)}", style="red", markup=False
        )
        return 2
    rows: list[dict[str, Any]] = []
    try:
        for name in args.names or TASKS:
            rows += task_rows(name, args, console)
    except BenchError as error:
        console.print(f"error: {error}", style="red", markup=False, highlight=False)
        return 2
    if args.json:
        print(json.dumps({"rows": rows}, indent=1, ensure_ascii=False))
    else:
        Console(width=None if sys.stdout.isatty() else 200).print(table(rows))
    return int(any(row["holds"] is False for row in rows))


if __name__ == "__main__":
    sys.exit(main())
