"""How often the damper monitor alarms for nothing, and how soon it finds a change: the table of docs/monitoring.md.

python scripts/monitor_damper.py           200 runs of each kind
python scripts/monitor_damper.py --runs 20 fewer
python scripts/monitor_damper.py --json    as JSON
python scripts/monitor_damper.py --docs docs   writes docs/monitoring_table.md as well
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import tyro

from bench.files import json_values, write_text
from bench.monitoring import MonitorSettings
from bench.monitoring.study import Line, StudyRun, line, service_run, switched_run

FINE = MonitorSettings(change=0.1)
HEADING = "# False alarms and delays of the damper monitor\n\nMade by `python scripts/monitor_damper.py --docs docs`.\n\n"
JUDGED = 30_000
"""First seed of the runs that are counted. The defaults of `MonitorSettings` were settled beside runs of the seeds 0 to 199, and how far
beyond the learnt motion a period is judged, and that a sum of powers is learnt, because of some from 10,000 and 20,000 on; none of
these judges any more."""
MAIN = 3
"""Kinds for which all runs are made: a fifth of C lost under each kind of motion."""


def kinds() -> list[tuple[str, Callable[[int], StudyRun]]]:
    """Name, and what makes a run."""
    found: list[tuple[str, Callable[[int], StudyRun]]] = [
        (f"synthetic damper, {motion} motion, C less 20 %", partial(service_run, motion, 0.2))
        for motion in ("harmonic", "wandering", "random")
    ]
    found += [
        ("the same, wandering, 5 % noise", partial(service_run, "wandering", 0.2, noise=0.05)),
        (
            "the same, wandering, lost over 20 periods",
            partial(service_run, "wandering", 0.2, gradual=67.0),
        ),
        (
            "the same, wandering, C less 10 %, 10 % sought",
            partial(service_run, "wandering", 0.1, settings=FINE),
        ),
        ("the same, wandering, C less 5 %, not sought", partial(service_run, "wandering", 0.05)),
    ]
    found += [
        (
            f"measured friction damper, band switched from {before} to {after} lbf{told}",
            partial(switched_run, before, after, settings=settings),
        )
        for before, after, settings, told in (
            (80, 35, None, ""),
            (35, 20, None, ""),
            (20, 35, None, ""),
            (80, 70, FINE, ", 10 % sought"),
            (80, 70, None, ", 9 % less"),
        )
    ]
    return found


def _counted(index: int, runs: int) -> Line:
    name, run = kinds()[index]
    count = runs if index < MAIN else max(runs // 4, 1)
    return line(name, run, range(JUDGED, JUDGED + count))


def as_markdown(lines: list[Line]) -> str:
    """The table."""
    rows = [
        "| watched | runs | healthy periods | false alarms per 1,000 | found within 10 | never found "
        "| delay [periods]: median, 95 %, largest | share told (true) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in lines:
        delay = "–" if math.isnan(row.delay[0]) else ", ".join(f"{value:g}" for value in row.delay)
        share = "–" if math.isnan(row.share) else f"{row.share:.3f} ({row.true:.3f})"
        rows.append(
            f"| {row.name} | {row.runs} | {row.periods} | {row.rate:.2f} | {100 * row.found:.1f} % | {row.missed} | {delay} | {share} |"
        )
    return "\n".join(rows) + "\n"


@dataclass
class Args:
    """Count false alarms and delays of the damper monitor."""

    runs: int = 200
    """Runs of each of the main kinds."""
    workers: int = 2
    """Processes."""
    docs: Path | None = None
    """Folder for monitoring_table.md."""
    json: bool = False
    """Print JSON."""


def _known(values: Sequence[float]) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values]


def main() -> None:
    """Run the study."""
    args = tyro.cli(Args, description=__doc__)
    with ProcessPoolExecutor(args.workers) as pool:
        lines = list(pool.map(_counted, range(len(kinds())), [args.runs] * len(kinds())))
    if args.docs is not None:
        write_text(args.docs / "monitoring_table.md", HEADING + as_markdown(lines))
    if args.json:
        told = [
            row._asdict() | {"delay": _known(row.delay), "share": _known([row.share])[0]} for row in lines
        ]
        print(json.dumps(json_values({"lines": told}), indent=1, ensure_ascii=False))
    else:
        print(as_markdown(lines), end="")


if __name__ == "__main__":
    main()
