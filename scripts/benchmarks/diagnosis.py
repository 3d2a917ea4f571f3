"""The diagnosis against what people would otherwise take, on the same cases in one run, all scored by the same code.

The peers are `mujoco.sysid` fitted to every candidate effect and chosen by its BIC (`peer_sysid`), and a global sparse
regression (`peer_sindy`). The cases are sealed ones made here with a fixed seed: ten short ones of one degree of freedom, some
fifteen minutes of two cores, with ``--full`` sixty of a release's length, of all kinds. Or, with ``--data FOLDER``, those of any
folder with an ``answers`` folder in it, which only the scoring opens: the cases of one degree of freedom, or with ``--rig joint`` those
of the joint. That is hours: `mujoco.sysid` takes three to five minutes for a case of 30 s at 1 kHz. On the joint it would take a
hundred; it is given ten times the diagnosis's time there. Stopped, it goes on where it was with ``--work FOLDER``.

    python scripts/benchmark.py diagnosis
    python scripts/benchmark.py diagnosis --data FOLDER --rig joint --work out/peers_joint --save diagnosis.json
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy import BlindOptions, BlindScore, diagnose, make_blind, read_case, score_blind
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.prediction.validation_discrepancy import DIVERGED_GAP, coordinates, noise_level, nrmse
from bench.files import write_text
from benchmarks.new_process import in_new_process, memory_row
from benchmarks.timing import Row

SEED = 20061
CASES, ALL_CASES = 10, 60
SHORT = BlindOptions(
    duration=6.0, sample_rate=500.0, noise=(0.003, 0.02), gap=(0.05, 0.5), shares=(0.25, 0.75, 0.0, 0.0),
    rigs=(1.0, 0.0, 0.0), detectability=False,
)  # fmt: skip
LONG = BlindOptions(rigs=(0.75, 0.0, 0.25), detectability=False)
LARGE, LARGE_CASES = BlindOptions(rigs=(0.0, 0.0, 1.0), detectability=False), 3
"""Cases whose memory is measured where no folder is given: of two degrees of freedom and a release's length."""
TIMES = 10.0
"""Time that `mujoco.sysid` is given on the joint, in units of the diagnosis's on the same case."""
DRAWS = 2000
"""Draws of the bootstrap over cases."""

Prediction = Callable[[CaseRecord], Mapping[str, NDArray[np.float64]]]
Tool = Callable[[Case, float], dict[str, Any]]
"""From a case and the seconds that it may take to what is scored."""


def ours(case: Case, _seconds: float = np.inf) -> dict[str, Any]:
    """The diagnosis."""
    return diagnose(case).verdict.to_json()


def by_sysid(case: Case, seconds: float = np.inf) -> dict[str, Any]:
    """`mujoco.sysid`, a candidate at a time."""
    from benchmarks import peer_sysid

    placed, predict = peer_sysid.diagnose(case, seconds=seconds)
    return _answer(case, None if placed is None else (placed.effect.name, placed.place.name), predict)


def by_sindy(case: Case, _seconds: float = np.inf) -> dict[str, Any]:
    """Sparse regression."""
    from benchmarks import peer_sindy

    return _answer(case, *peer_sindy.diagnose(case))


TOOLS: dict[str, Tool] = {"ours": ours, "mujoco.sysid + BIC": by_sysid, "pysindy": by_sindy}


def _answer(case: Case, found: tuple[str, str] | None, predict: Prediction) -> dict[str, Any]:
    """What a peer found in the form that is scored, its gap judged as the diagnosis judges its own."""
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    predicted = [predict(record) for record in case.validation]
    gaps = []
    for _, channels in coordinates(structure):
        measured = np.concatenate([sum(s * r.values[c] for c, s in channels) for r in case.validation])
        simulated = np.concatenate([sum(s * p[c] for c, s in channels) for p in predicted])
        floor = noise_level(problem, channels, case.validation) / float(np.std(measured))
        gaps.append({"after": nrmse(measured, simulated), "noise_floor": floor})
    named = [] if found is None else [{"name": found[0], "where": found[1], "probability": 1.0}]
    return {"verdict": "effect" if found else "none", "named": named, "indistinguishable": [], "gaps": gaps}


@dataclass(frozen=True)
class Outcome:
    """A tool on a case.

    Attributes:
        score: The score of this case alone.
        seconds: Wall time [s].
    """

    score: BlindScore
    seconds: float


def outcomes(
    cases: Sequence[Path], answers: Path, folder: Path, progress: Callable[[str], None] = lambda text: None
) -> dict[str, list[Outcome]]:
    """Run every tool on every case, one after the other, and score each; what the folder holds already is not run again."""
    ours(
        read_case(cases[0]), np.inf
    )  # compiled code and native callbacks are loaded before anything is timed
    found: dict[str, list[Outcome]] = {name: [] for name in TOOLS}
    for path in cases:
        case = read_case(path)
        for number, (name, tool) in enumerate(TOOLS.items()):
            told = folder / str(number) / path.name / f"{path.name}.json"
            if not told.exists():
                progress(f"{path.name}: {name}")
                begun = time.perf_counter()
                limit = TIMES * found["ours"][-1].seconds if number and case.rig == "joint" else np.inf
                answer = tool(case, limit)
                answer["seconds"] = time.perf_counter() - begun
                write_text(told, json.dumps(answer))
            seconds = json.loads(told.read_text(encoding="utf-8"))["seconds"]
            found[name].append(Outcome(score_blind(told.parent, answers, cases=path.parent), seconds))
    return found


def rows(
    repeats: int = 15,
    *,
    full: bool = False,
    data: Path | None = None,
    rig: str = "sdof",
    work: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Row]:
    """Rows of the group; a run of each tool a case, whatever `repeats`, and the spread is that over cases."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) if work is None else work
        if data is None:
            rng = np.random.default_rng(SEED)
            count, options = (ALL_CASES, LONG) if full else (CASES, SHORT)
            home, answers = folder / "cases", folder / "answers"
            make_blind(home, answers, n=count, rng=rng, options=options, progress=progress)
            large = folder / "large"
            make_blind(large, folder / "unread", n=LARGE_CASES, rng=rng, options=LARGE, progress=progress)
        else:
            home, answers = data, data / "answers"
            large = data
        cases = sorted(path.parent for path in home.glob("*/nominal.json"))
        if data is not None:
            cases = [path for path in cases if read_case(path).rig == rig]
        limited = any(read_case(path).rig == "joint" for path in cases)
        told = outcomes(cases, answers, folder / "results", progress)
        memory = _memory(large, progress)
    return [
        *(
            row
            for peer in list(TOOLS)[1:]
            for row in _against(peer, told["ours"], told[peer], limited=limited)
        ),
        *([memory] if memory else []),
    ]


def _memory(folder: Path, progress: Callable[[str], None]) -> Row | None:
    """Largest memory that our diagnosis of the first joint cases of a folder takes, each in a process of its own."""
    found = sorted(path.parent for path in folder.glob("*/nominal.json"))
    peaks = []
    for path in [path for path in found if read_case(path).rig == "joint"][:LARGE_CASES]:
        progress(f"{path.name}: memory")
        code = f"from bench.discrepancy import diagnose_folder; diagnose_folder({str(path)!r})"
        peaks.append(in_new_process(code)[1])
    return memory_row("a diagnosis of two degrees of freedom", peaks) if peaks else None


def _against(peer: str, mine: list[Outcome], theirs: list[Outcome], *, limited: bool = False) -> list[Row]:
    """Ours over the peer's where more is better, the peer's over ours where less is; `limited`: its time was given."""

    def shares(label: str, value: Callable[[BlindScore], float]) -> Row | None:
        pairs = np.array([[value(a.score), value(b.score)] for a, b in zip(mine, theirs, strict=True)])
        pairs = pairs[np.isfinite(pairs).all(axis=1)]
        if not len(pairs):
            return None
        # a peer that is never right counts as right in half a case, that there be a ratio
        least = 0.5 / len(pairs)

        def ratio(sample: NDArray[np.float64]) -> float:
            own, other = sample.mean(axis=0)
            return float(own / max(other, least))

        return _row(f"{label}, against {peer}", pairs, ratio, "≥ 1", _told(pairs.mean(axis=0), len(pairs)))

    def lower(label: str, pairs: NDArray[np.float64], limit: str) -> Row:
        def ratio(sample: NDArray[np.float64]) -> float:
            own, other = np.median(sample, axis=0)
            return float(other / own)

        return _row(
            f"{label}, against {peer}", pairs, ratio, limit, _told(np.median(pairs, axis=0), len(pairs))
        )

    gaps = np.array([[a.score.median_ratio, b.score.median_ratio] for a, b in zip(mine, theirs, strict=True)])
    seconds = np.array([[a.seconds, b.seconds] for a, b in zip(mine, theirs, strict=True)])
    # a linear regression is quicker than any fit of free runs: reported against pysindy, without a limit
    pace = "≥ 1" if peer.startswith("mujoco") and not limited else ""
    made = [
        shares("single effects named exactly", lambda s: s.exact),
        shares("single effects, family right", lambda s: s.family),
        shares("joint: axis right", lambda s: s.place),
        shares("two effects: both named", lambda s: s.both_named),
        shares("foreign effects called unknown, or what they are", lambda s: s.unknown_caught),
        shares("clean cases called clean", lambda s: 1.0 - s.false_alarms),
        lower("gap after over noise floor, median", np.minimum(gaps, DIVERGED_GAP), "≥ 1"),
        lower("seconds a case, median", seconds, pace),
    ]
    return [row for row in made if row is not None]


def _told(figures: NDArray[np.float64], count: int) -> str:
    return f"ours {figures[0]:.3g}, theirs {figures[1]:.3g}, {count} cases"


def _row(
    name: str,
    pairs: NDArray[np.float64],
    ratio: Callable[[NDArray[np.float64]], float],
    limit: str,
    told: str,
) -> Row:
    rng = np.random.default_rng(SEED)
    draws = [ratio(pairs[rng.integers(len(pairs), size=len(pairs))]) for _ in range(DRAWS)]
    low, high = np.percentile(draws, [10, 90])
    return Row(name, ratio(pairs), (float(low), float(high)), limit, told, {"pairs": pairs.tolist()})
