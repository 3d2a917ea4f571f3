"""Hold the diagnoses of two checkouts against each other, to the last digit: what a refactoring must leave alone.

    python scripts/same_verdicts.py --before ../before --cases FOLDER FOLDER ... [--after .] [--repeats 3] [--json]
    python scripts/same_verdicts.py --before ../before --example --pendulums 3 --measured friction_damper_20lb --data FOLDER

A case is a folder as `jointbench diagnose` reads it. Beside folders: the worked example and pendulums, whose records are made
here, and measured records by the names that scripts/diagnose_measured.py knows. Each checkout has one process that diagnoses the
cases one after the other; the two take turns, so that what else the machine does falls on both. Compared is the whole verdict but
its time: kind, named effects, parameters, locations, discrepancies, words. The time is that of the processor, the least of the repeats.
A case in which either checkout ends with an error is told as such. The exit status is 1 where anything differs.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent


@dataclass
class Args:
    """Hold the diagnoses of two checkouts against each other."""

    before: Path
    """Checkout to compare with."""
    after: Path = ROOT
    """Checkout that was changed."""
    cases: tuple[Path, ...] = ()
    """Folders of cases."""
    example: bool = False
    """The worked example as well."""
    pendulums: int = 0
    """That many pendulums as well, each with another missing force."""
    measured: tuple[str, ...] = ()
    """Measured records as well: names, or beginnings of names."""
    data: Path | None = None
    """Folder of the measured records that are not shipped."""
    repeats: int = 1
    """Diagnoses of every case and checkout; the shortest time counts."""
    ignore: tuple[str, ...] = ()
    """Keys of the verdict that may differ."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Compared:
    """One case in both checkouts.

    Attributes:
        case: Name.
        verdict: Of the checkout that was changed, with the effects named.
        differences: Paths into the verdict with both values; empty where all is equal.
        seconds: Least processor time before and after [s].
    """

    case: str
    verdict: str
    differences: tuple[str, ...]
    seconds: tuple[float, float]


class Worker:
    """A process that answers questions with the code of one checkout: by default, diagnoses."""

    def __init__(self, checkout: Path, script: str = __file__) -> None:
        path = os.pathsep.join([str(checkout.resolve()), str(checkout.resolve() / "scripts")])
        self.checkout = checkout.resolve()
        self.process = subprocess.Popen(
            [sys.executable, str(Path(script).resolve()), "--worker"],
            env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        home = Path(self.ask({})["home"])
        if not home.is_relative_to(self.checkout):
            raise SystemExit(f"error: {self.checkout} was to be compared, but {home} is imported")

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        """Send a question and return the answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"error: the work on {question} with {self.checkout} ended early")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def work(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Answer questions until there are none; what is imported is the checkout's. The first one, empty, asks where `bench` lies."""
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        question = json.loads(line)
        answers.write(json.dumps(answer(question) if question else _home()) + "\n")
        answers.flush()


def _home() -> dict[str, Any]:
    import bench

    return {"home": str(Path(bench.__file__).resolve())}


def _answer(question: dict[str, Any]) -> dict[str, Any]:
    from bench.discrepancy import diagnose, read_case
    from bench.errors import BenchError

    try:
        if "folder" in question:
            case = read_case(question["folder"])
        else:
            import diagnose_measured

            data = question["data"] and Path(question["data"])
            case = diagnose_measured.gather(data, (question["measured"],))[question["measured"]].case
        begun = time.process_time()
        told = diagnose(case).verdict.to_json()
    except Exception as error:  # a checkout that is broken in one case is compared in the others
        if not isinstance(error, BenchError):
            traceback.print_exc()
        return {"seconds": 0.0, "verdict": {"verdict": "error", "error": f"{type(error).__name__}: {error}"}}
    told.pop("seconds", None)
    return {"seconds": time.process_time() - begun, "verdict": told}


def differences(before: Any, after: Any, path: str = "") -> Iterator[str]:
    """Paths at which two JSON values differ, with both values."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted({*before, *after}):
            yield from differences(before.get(key, "absent"), after.get(key, "absent"), f"{path}.{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for k, (a, b) in enumerate(zip(before, after, strict=True)):
            yield from differences(a, b, f"{path}[{k}]")
    elif before != after:
        yield f"{path.lstrip('.')}: {before!r} before, {after!r} after"


def questions(args: Args, folder: Path) -> dict[str, dict[str, Any]]:
    """What the workers are asked, by name of the case; cases that are made lie under `folder`."""
    asked: dict[str, dict[str, Any]] = {str(case): {"folder": str(case.resolve())} for case in args.cases}
    sys.path[:0] = [str(ROOT), str(ROOT / "scripts"), str(ROOT / "examples" / "mismatch")]
    if args.example:
        import measure  # pyrefly: ignore[missing-import]  (found in examples/mismatch)

        asked["example"] = {"folder": str(measure.measure(folder / "example"))}
    for k in range(args.pendulums):
        import numpy as np
        import pendulum

        kind = pendulum.KINDS[(k + 1) % len(pendulum.KINDS)]
        place = folder / f"pendulum-{k}"
        place.mkdir()
        pendulum.measure(place, kind, np.random.default_rng((20061, k)))
        asked[f"pendulum with {kind.name or 'nothing'}"] = {"folder": str(place)}
    if args.measured:
        import diagnose_measured

        for name in diagnose_measured.gather(args.data, args.measured):
            asked[name] = {"measured": name, "data": args.data and str(args.data.resolve())}
    return asked


def compare(args: Args) -> Iterator[Compared]:
    """Diagnose every case with both checkouts."""
    with tempfile.TemporaryDirectory() as made:
        asked = questions(args, Path(made))
        workers = (Worker(args.before), Worker(args.after))
        for name, question in asked.items():
            told = [[worker.ask(question) for worker in workers] for _ in range(max(args.repeats, 1))]
            verdicts = [
                [{k: v for k, v in answer["verdict"].items() if k not in args.ignore} for answer in pair]
                for pair in told
            ]
            found = [
                *differences(verdicts[0][0], verdicts[0][1]),
                *(
                    f"{who} run {k}: {difference}"
                    for k in range(1, len(told))
                    for i, who in enumerate(("before", "after"))
                    for difference in differences(verdicts[0][i], verdicts[k][i])
                ),
            ]
            last = told[0][1]["verdict"]
            said = " ".join([last["verdict"], *(effect["name"] for effect in last.get("named", ()))])
            least = tuple(min(pair[i]["seconds"] for pair in told) for i in range(2))
            yield Compared(name, last.get("error", said), tuple(found), (least[0], least[1]))
        for worker in workers:
            worker.close()


def main() -> int:
    """Compare and print."""
    if sys.argv[1:] == ["--worker"]:
        sys.path.pop(0)  # the scripts beside this one: those of the checkout are meant
        work(_answer)
        return 0
    import tyro

    args = tyro.cli(Args, description=__doc__)
    rows: list[Compared] = []
    for row in compare(args):
        rows.append(row)
        if not args.json:
            state = f"{len(row.differences)} differences" if row.differences else "equal"
            print(
                f"{row.case}: {row.verdict}; {state}; {row.seconds[0]:.2f} s before, {row.seconds[1]:.2f} s after"
            )
            for difference in row.differences[:20]:
                print(f"    {difference}", flush=True)
    if args.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
    elif rows:
        ratio = sum(r.seconds[1] for r in rows) / max(sum(r.seconds[0] for r in rows), 1e-9)
        same = sum(not row.differences for row in rows)
        print(f"{same} of {len(rows)} cases equal to the last digit; {100 * (ratio - 1):+.1f} % time")
    return int(any(row.differences for row in rows))


if __name__ == "__main__":
    sys.exit(main())
