"""Move each threshold of the diagnosis by a factor, both ways, and table which verdicts change.

    python scripts/perturb_settings.py --cases FOLDER FOLDER ... --out perturbed.jsonl [--rooms search judgement] [--jobs 2] [--json]

Every diagnosis is one line of `--out`, written as it ends; a run that was stopped goes on where it was. Compared are the kind of the
verdict and the named effects; a threshold that changes either on any case is fragile there. Counts are moved by at least one, shares
stay below one. What only saves time ("a cost cut-off") and flips a verdict says that the search ended too early.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import tyro

from bench.discrepancy.settings import DEFAULT, DescribedSetting, described, with_values

SHARES = ("part of", "share", "probability", "correlation", "coherence")
"""First words of the meaning of a number that has to stay below one."""


@dataclass
class Args:
    """Move each threshold by a factor both ways and table which verdicts change."""

    cases: tuple[Path, ...]
    """Folders of cases."""
    out: Path = Path("perturbed.jsonl")
    """File of the results so far; what it holds is not computed again."""
    factor: float = 1.5
    """Factor."""
    rooms: tuple[str, ...] = ()
    """Beginnings of the paths of thresholds; all where none is given."""
    jobs: int = 1
    """Processes."""
    budget: float = 600.0
    """Seconds a diagnosis may take before it begins no further stage."""
    json: bool = False
    """Print JSON."""


class Task(NamedTuple):
    """One diagnosis: a case, and a threshold with its value; the defaults where the path is empty."""

    case: str
    path: str
    value: Any

    @property
    def key(self) -> str:
        """What tells it from the others."""
        return hashlib.sha256(json.dumps(self).encode()).hexdigest()[:16]


def moved(entry: DescribedSetting, factor: float) -> Any:
    """The value of a threshold times a factor."""

    def one(value: Any) -> Any:
        if isinstance(value, int):
            new = round(value * factor)
            return max(new + (new == value) * (1 if factor > 1.0 else -1), 1)
        new = value * factor
        below = 0.0 < value < 1.0 and entry.meaning.lower().startswith(SHARES)
        return min(new, 0.5 * (1.0 + value)) if below else new

    return [one(value) for value in entry.default] if isinstance(entry.default, tuple) else one(entry.default)


def tasks(args: Args) -> Iterator[Task]:
    """All diagnoses, those with the defaults first."""
    cases = [str(case) for case in args.cases]
    for case in cases:
        yield Task(case, "", None)
    for entry in described(DEFAULT):
        if args.rooms and not entry.path.startswith(args.rooms):
            continue
        for factor in (args.factor, 1.0 / args.factor):
            value = moved(entry, factor)
            if value != (list(entry.default) if isinstance(entry.default, tuple) else entry.default):
                yield from (Task(case, entry.path, value) for case in cases)


def verdict_of(task: Task, budget: float) -> dict[str, Any]:
    """Kind and names of the verdict of one diagnosis."""
    from bench.discrepancy import diagnose, read_case
    from bench.errors import BenchError

    values: Any = task.value
    for name in reversed(task.path.split(".") if task.path else []):
        values = {name: values}
    try:
        found = diagnose(read_case(task.case), settings=with_values(DEFAULT, values or {}), budget=budget)
    except (BenchError, ArithmeticError, ValueError) as error:
        return {"verdict": "error", "named": [type(error).__name__]}
    return {
        "verdict": found.verdict.verdict,
        "named": sorted(effect.name for effect in found.verdict.named),
    }


def run(args: Args) -> dict[str, dict[str, Any]]:
    """Results by key, computed where the file does not hold them."""
    known: dict[str, dict[str, Any]] = {}
    if args.out.exists():
        known = {row["key"]: row for row in map(json.loads, args.out.read_text().splitlines())}
    todo = [task for task in tasks(args) if task.key not in known]
    with ProcessPoolExecutor(args.jobs) as pool, args.out.open("a") as file:
        waiting = {pool.submit(verdict_of, task, args.budget): task for task in todo}
        for done in as_completed(waiting):
            task = waiting[done]
            known[task.key] = {"key": task.key, **task._asdict(), **done.result()}
            file.write(json.dumps(known[task.key]) + "\n")
            file.flush()
            print(f"{len(known)}: {task.path or 'defaults'} {task.value} {task.case}", file=sys.stderr)
    return known


def changes(args: Args, known: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Thresholds that change a verdict, with the cases and what became of them."""
    rows = [known[task.key] for task in tasks(args) if task.key in known]
    usual = {row["case"]: (row["verdict"], row["named"]) for row in rows if not row["path"]}
    out = []
    for row in rows:
        now = (row["verdict"], row["named"])
        if row["path"] and now != usual[row["case"]]:
            before, after = (" ".join([kind, *names]) for kind, names in (usual[row["case"]], now))
            out.append(
                {
                    "setting": row["path"],
                    "value": row["value"],
                    "case": row["case"],
                    "before": before,
                    "after": after,
                }
            )
    return out


def main() -> None:
    """Run and print the table."""
    args = tyro.cli(Args, description=__doc__)
    known = run(args)
    found = changes(args, known)
    if args.json:
        print(json.dumps(found, indent=1))
        return
    moved_ones = {row["path"] for row in known.values() if row["path"]}
    print(f"{len({row['setting'] for row in found})} of {len(moved_ones)} thresholds change a verdict")
    for row in found:
        print(
            f"{row['setting']} = {row['value']}: {Path(row['case']).name}: {row['before']} -> {row['after']}"
        )


if __name__ == "__main__":
    main()
