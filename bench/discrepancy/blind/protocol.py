"""The blind protocol: sealed cases, a diagnosis that never sees the answers, and the scoring.

`make_blind` writes cases into one folder and their answers into another; beside each case stands the SHA-256 of its answer,
so that nobody can change an answer afterwards, and the answer holds a random salt, so that nobody can guess it from
the hash. `run_blind` opens the cases only. `bench.discrepancy.blind.scoring.score_blind` opens both and checks the hashes.

Cases are functions of a seed and their number, each with a generator of its own: a maker that was stopped goes on
where it was, several processes make the same cases as one, and whoever is told the seed afterwards can make them again.
What is drawn, and how it is integrated, stands in `drawing`, `withheld_effects` and `ground_truth`.

Leave-one-out: the maker writes ``protocol.json`` with the effect to be struck from the catalogue into the case folder, and the
runner obeys it. The runner is a messenger here: the diagnosis is handed a smaller catalogue and not told why.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import multiprocessing
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.blind.drawing import BlindOptions, draw_case
from bench.discrepancy.blind.robot_cases import draw_robot_case
from bench.discrepancy.blind.schema import ANSWER_LIMITS, ProtocolDocument
from bench.discrepancy.case.case import Case, CaseChannel
from bench.documents import parse_json
from bench.documents.loading import load_document
from bench.errors import BenchError, FileFormatError, ParameterError
from bench.files import together, write_bytes, write_text
from bench.progress import Tell

__all__ = ["BlindOptions", "draw_case", "make_blind", "run_blind", "write_case"]

SEAL = "answer.sha256"
PROTOCOL = "protocol.json"


def make_blind(
    folder: str | Path,
    answers: str | Path,
    *,
    n: int,
    rng: np.random.Generator,
    options: BlindOptions | None = None,
    workers: int = 1,
    progress: Tell = lambda text: None,
) -> list[str]:
    """Make sealed cases; those that are there and whole are left alone.

    Args:
        folder: Where the cases go, a folder each.
        answers: Where the answers go; another folder.
        n: Number of cases.
        rng: Source of the seed of all cases.
        options: What to draw from.
        workers: Processes.
        progress: Called with a line for every case.

    Returns:
        Names of the cases.

    Raises:
        ParameterError: The two folders are the same, or one lies within the other.
        FileFormatError: The folder holds cases of another seed.
    """
    folder, answers = Path(folder), Path(answers)
    here, there = folder.resolve(), answers.resolve()
    if here == there or here in there.parents:
        raise ParameterError(
            f"cases and answers would both go to '{folder}'; give the answers a folder of their own"
        )
    options = options or BlindOptions()
    seed = int(rng.integers(2**62))
    tasks = [(f"case-{i:03d}", folder, answers, seed, i, options) for i in range(n)]
    for line in _spread(_make_one, tasks, workers):
        progress(line)
    return [task[0] for task in tasks]


def _make_one(task: tuple[str, Path, Path, int, int, BlindOptions]) -> str:
    name, folder, answers, seed, index, options = task
    sealed, answer_file = folder / name / SEAL, answers / f"{name}.json"
    rng = np.random.default_rng([seed, index])
    salt = rng.bytes(16).hex()  # drawn first, so that it also tells whether a case at hand is of this seed
    if sealed.is_file() and answer_file.is_file():
        text = answer_file.read_text(encoding="utf-8")
        if sealed.read_text().strip() == _digest(text) and _salt(text, answer_file) == salt:
            return f"{name} is there"
        raise FileFormatError(
            f"'{folder / name}' is a case of another seed, or was changed; give an empty folder, or remove it"
        )
    case, answer = (draw_robot_case if options.robots else draw_case)(name, rng, options)
    text = json.dumps(answer | {"salt": salt}, indent=1)
    with together():  # no case without its answer
        if options.leave_one_out:
            write_text(folder / name / PROTOCOL, json.dumps({"exclude": answer["struck"]}))
        write_case(case, folder / name)
        write_text(answer_file, text)
        write_text(sealed, _digest(text) + "\n")
    return f"{name} made"


def _salt(text: str, file: Path) -> Any:
    return parse_json(text, str(file), limits=ANSWER_LIMITS).get("salt")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _spread(work: Callable[[Any], str], tasks: list[Any], workers: int) -> Iterator[str]:
    """Lines that `work` returns for each task, as they come, over processes."""
    if workers <= 1:
        yield from map(work, tasks)
        return
    # spawned, not forked: MuJoCo's and numba's threads do not survive a fork
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(work, task) for task in tasks]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def write_case(case: Case, folder: str | Path) -> None:
    """Write a case as a folder that `read_case` reads; equal cases give equal bytes."""
    folder = Path(folder)
    for record in (*case.identification, *case.validation):
        table = np.column_stack([record.time, *record.values.values()])
        text = io.StringIO()
        header = ",".join(["time", *record.values])
        np.savetxt(text, table, delimiter=",", header=header, comments="", fmt="%.8g")
        write_bytes(folder / f"{record.name}.csv.gz", gzip.compress(text.getvalue().encode(), mtime=0))
    nominal = {
        "rig": case.rig,
        "sample_rate_hz": 1.0 / case.identification[0].step,
        "parameters": {p.name: p.entry for p in case.parameters},
        "channels": {
            "time": {"unit": "s"},
            **{c.name: _entry_of(c) for c in case.channels},
        },
        **case.options,
    }
    if case.folder is not None:  # a model of its own
        write_bytes(folder / case.rig, (case.folder / case.rig).read_bytes())
    # last, since it is what makes a folder a case
    write_text(folder / "nominal.json", json.dumps(nominal, indent=1))


def _entry_of(channel: CaseChannel) -> dict[str, Any]:
    """The entry of a channel in ``nominal.json``."""
    kind, _, target = channel.target.partition(":")
    more = {
        kind: target,
        "quantity": channel.quantity,
        "side": channel.side,
        "resolution": channel.resolution,
    }
    return {
        "unit": channel.unit,
        "role": channel.role,
        "noise_std": channel.noise_std,
        **{key: value for key, value in more.items() if key and value},
    }


def run_blind(
    folder: str | Path,
    results: str | Path,
    *,
    again: bool = False,
    workers: int = 1,
    progress: Tell = lambda text: None,
    **options: Any,
) -> list[Path]:
    """Diagnose every case of a folder and write one JSON file each; answers are never opened.

    A diagnosis that fails is written as the verdict "failed", which no answer agrees with.

    Args:
        folder: Folder of case folders.
        results: Where the JSON files go.
        again: Diagnose cases whose result is there already as well.
        workers: Processes.
        progress: Called with a line for every case.
        **options: Passed to `diagnose`; `exclude` is added to what a case's protocol strikes.

    Raises:
        FileFormatError: There is no case.
        DocumentError: The protocol of a case has an entry that is not known or of the wrong kind.
    """
    folder, results = Path(folder), Path(results)
    cases = sorted(path.parent for path in folder.glob("*/nominal.json"))
    if not cases:
        raise FileFormatError(f"no case folder (one with nominal.json) in '{folder}'")
    targets = [results / f"{path.name}.json" for path in cases]
    tasks = [
        (path, target, _struck(path, options))
        for path, target in zip(cases, targets, strict=True)
        if again or not target.is_file()
    ]
    for target in () if again else [t for t in targets if t.is_file()]:
        if "verdict" not in load_document(target):
            raise FileFormatError(
                f"'{target}' is no verdict of an earlier run (answers?); give a folder of its own for results, or --again to replace it"
            )
    if len(tasks) < len(cases):
        progress(f"{len(cases) - len(tasks)} results are there already")
    for line in _spread(_run_one, tasks, workers):
        progress(line)
    return targets


def _struck(path: Path, options: dict[str, Any]) -> dict[str, Any]:
    """The options, with what the protocol of a case strikes; read before any case is diagnosed."""
    protocol = path / PROTOCOL
    if not protocol.is_file():
        return options
    struck = ProtocolDocument.read(protocol).exclude
    return options | {"exclude": tuple(sorted({*options.get("exclude", ()), *struck}))}


def _run_one(task: tuple[Path, Path, dict[str, Any]]) -> str:
    from bench.discrepancy.diagnosis import diagnose_folder  # noqa: PLC0415  (the maker does not need it)

    path, target, options = task
    try:
        # a planted polarity or gain is to be named here, not refused as one of the recording
        verdict = diagnose_folder(path, **{"anyway": True, **options}).verdict
    except KeyboardInterrupt:
        raise
    except Exception as error:  # one case that fails is one wrong answer, not the end of the run
        plain = str(error) if isinstance(error, BenchError) and str(error) else traceback.format_exc(limit=-3)
        write_text(target, json.dumps({"verdict": "failed", "named": [], "error": plain}, indent=1))
        return f"{path.name}: failed ({plain.splitlines()[-1]})"
    write_text(target, json.dumps(verdict.to_json(), indent=1))
    return f"{path.name}: {verdict.explanation} ({verdict.seconds:.1f} s)"
