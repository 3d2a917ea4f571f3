"""Move each threshold of the diagnosis by a factor, both ways, and table which verdicts change.

    python scripts/perturb_settings.py --cases FOLDER FOLDER ... --out perturbed.jsonl [--rooms search judgement] [--jobs 2] [--json]

Every diagnosis is one line of `--out`, written as it ends; a run that was stopped goes on where it was. Compared are the kind of the
verdict and the named effects; a threshold that changes either on any case is fragile there. Counts are moved by at least one, shares
stay below one. What only saves time ("a cost cut-off") and flips a verdict says that the search ended too early. A diagnosis is the
same in every run, so a threshold that the one with the defaults does not read before its names are settled cannot change them; such
diagnoses are not run.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

import tyro

from bench.discrepancy.settings import DEFAULT, DescribedSetting, described, with_values

SHARES = ("part of", "share", "probability", "correlation", "coherence")
"""First words of the meaning of a number that has to stay below one."""

SETTLED = "gap on the judging records"
"""What a diagnosis of a linear structure tells of its progress once kind and names of its verdict are settled."""


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


def defaults(args: Args) -> list[Task]:
    """The diagnoses with the defaults."""
    return [Task(str(case), "", None) for case in args.cases]


def tasks(args: Args, known: dict[str, dict[str, Any]]) -> Iterator[Task]:
    """The diagnoses with one threshold moved, of the cases whose diagnosis with the defaults reads it."""
    for entry in described(DEFAULT):
        if args.rooms and not entry.path.startswith(args.rooms):
            continue
        for factor in (args.factor, 1.0 / args.factor):
            value = moved(entry, factor)
            if value == (list(entry.default) if isinstance(entry.default, tuple) else entry.default):
                continue
            for usual in defaults(args):
                if entry.path in known[usual.key]["read"]:
                    yield Task(usual.case, entry.path, value)


@contextmanager
def reading() -> Generator[Callable[[], list[str]]]:
    """Within it the thresholds that are read are noted; gives what returns their paths, by class and name."""
    read: set[tuple[type, str]] = set()
    owners = {path: _owner(path) for path in (entry.path for entry in described(DEFAULT))}
    kinds = set(owners.values()) | {type(DEFAULT)}

    def noted(kind: type, names: set[str]) -> Any:
        def get(self: Any, name: str) -> Any:
            if name in names:
                read.add((kind, name))
            return object.__getattribute__(self, name)

        return get

    for kind in kinds:
        kind.__getattribute__ = noted(kind, {entry.name for entry in fields(kind)})
    try:
        yield lambda: [path for path, kind in owners.items() if (kind, path.rpartition(".")[2]) in read]
    finally:
        for kind in kinds:
            del kind.__getattribute__


def _owner(path: str) -> type:
    holder = reduce(getattr, path.split(".")[:-1], DEFAULT)
    assert is_dataclass(holder)
    return type(holder)


def verdict_of(task: Task, budget: float) -> dict[str, Any]:
    """Kind and names of the verdict of one diagnosis; of one with the defaults also the thresholds that it reads."""
    from bench.discrepancy import Diagnosis, diagnose, read_case
    from bench.errors import BenchError

    values: Any = task.value
    for name in reversed(task.path.split(".") if task.path else []):
        values = {name: values}
    settings = with_values(DEFAULT, values or {})
    settled: list[list[str]] = []
    try:
        if task.path:
            found = diagnose(read_case(task.case), settings=settings, budget=budget)
        else:
            with reading() as read:
                found = diagnose(
                    read_case(task.case),
                    settings=settings,
                    budget=budget,
                    progress=lambda text: settled.append(read()) if text == SETTLED else None,
                )
                # an MJCF may be asked once more, by the equations of its drives
                if not settled or not isinstance(found, Diagnosis) or found.case.rig.endswith(".xml"):
                    settled.append(read())
    except (BenchError, ArithmeticError, ValueError) as error:
        return {"verdict": "error", "named": [type(error).__name__]}
    return {
        "verdict": found.verdict.verdict,
        "named": sorted(effect.name for effect in found.verdict.named),
        **({"read": settled[-1]} if settled else {}),
    }


def run(args: Args) -> dict[str, dict[str, Any]]:
    """Results by key, computed where the file does not hold them."""
    known: dict[str, dict[str, Any]] = {}
    if args.out.exists():
        known = {row["key"]: row for row in map(json.loads, args.out.read_text().splitlines())}
    with ProcessPoolExecutor(args.jobs) as pool, args.out.open("a") as file:

        def added(asked: list[Task]) -> None:
            waiting = {
                pool.submit(verdict_of, task, args.budget): task for task in asked if task.key not in known
            }
            for number, done in enumerate(as_completed(waiting), 1):
                task = waiting[done]
                known[task.key] = {"key": task.key, **task._asdict(), **done.result()}
                file.write(json.dumps(known[task.key]) + "\n")
                file.flush()
                print(
                    f"{number} of {len(waiting)}: {task.path or 'defaults'} {task.value} {task.case}",
                    file=sys.stderr,
                )

        added(defaults(args))
        added(list(tasks(args, known)))
    return known


def changes(args: Args, known: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Thresholds that change a verdict, with the cases and what became of them."""
    usual = {
        row["case"]: (row["verdict"], row["named"]) for row in (known[task.key] for task in defaults(args))
    }
    out = []
    for row in (known[task.key] for task in tasks(args, known)):
        now = (row["verdict"], row["named"])
        if now != usual[row["case"]]:
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
