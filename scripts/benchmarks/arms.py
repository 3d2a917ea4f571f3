"""The diagnosis of articulated models against `mujoco.sysid`, on the same records, in the same time, judged by the same free runs.

The peer fits one class of parameters (`peer_sysid_arms`) and names nothing; what is compared is what either leaves of records that it has
not seen, the other joints as measured. With ``--data FOLDER`` every fourth case of a folder of arms, or, where that holds ``so101``, the
public record of that robot: learned from some motions, judged by fifteen others. Without, sealed two-link arms made here.

    python scripts/benchmark.py arms --data FOLDER
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from robot_records.case_folders import write_folder
from robot_records.free_run_errors import errors_of
from robot_records.robots import so101

from bench.arrays import Array
from bench.discrepancy import BlindOptions, make_blind, read_case
from bench.discrepancy.articulated.diagnosis import diagnose_articulated
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.multibody.channels import bound
from bench.files import write_text
from benchmarks.peer_sysid_arms import Fit
from benchmarks.timing import Row

EVERY = 4
"""Of a folder's cases, which are taken: ten of forty."""
OWN, SEED, DRAWS = 4, 31, 2000
"""Cases that are made where no folder is given, their seed, and draws of the bootstrap over cases."""


def rows(
    repeats: int = 15,
    *,
    data: Path | None = None,
    work: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Row]:
    """Rows of the group; each case is run once, whatever `repeats`, and the spread is that over cases."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) if work is None else work
        if data is not None and (data / "so101").is_dir():
            return _so101(data, folder, progress)
        if data is None:
            data = folder / "cases"
            options = BlindOptions(robots=("arm",), detectability=False)
            make_blind(
                data,
                folder / "answers",
                n=OWN,
                rng=np.random.default_rng(SEED),
                options=options,
                progress=progress,
            )
        every = 1 if data == folder / "cases" else EVERY
        pairs = [
            _compared(path.parent, folder, progress) for path in sorted(data.glob("*/nominal.json"))[::every]
        ]
    left, seconds = np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
    told = f"ours {np.median(left[:, 0]):.3g}, theirs {np.median(left[:, 1]):.3g}, {len(left)} cases of {np.median(seconds):.0f} s each"
    return [_row("worst joint's NRMSE, unseen records, against mujoco.sysid", left, "≥ 1", told)]


def _compared(path: Path, folder: Path, progress: Callable[[str], None]) -> tuple[list[float], float]:
    """NRMSE of the worst joint, ours and theirs, and seconds; what the folder holds already is not run again."""
    kept = folder / "arms" / f"{path.name}.json"
    if not kept.is_file():
        case = read_case(path)
        progress(f"{path.name}: ours")
        begun = time.perf_counter()
        verdict = diagnose_articulated(case).verdict
        seconds = time.perf_counter() - begun
        progress(f"{path.name}: mujoco.sysid, {seconds:.0f} s")
        fit = Fit(case)
        theirs = fit.errors(fit.fitted(seconds), case)
        worst = [max(gap.after for gap in verdict.gaps), float(np.sqrt(np.mean(theirs**2, axis=0)).max())]
        write_text(kept, json.dumps([worst, seconds]))
    worst, seconds = json.loads(kept.read_text(encoding="utf-8"))
    return worst, seconds


def _so101(data: Path, folder: Path, progress: Callable[[str], None]) -> list[Row]:
    """SO-101: both learn from the motions that `scripts/robots.py` takes, and are judged by whole motions that neither has seen."""
    records = so101(data)
    write_folder(records, folder / "learned")
    write_folder(replace(records, validation=records.further), folder / "judged")
    case, judged = read_case(folder / "learned"), read_case(folder / "judged")
    progress("SO-101: ours")
    begun = time.perf_counter()
    found = diagnose_articulated(case, anyway=True)
    seconds = time.perf_counter() - begun
    progress(f"SO-101: mujoco.sysid, {seconds:.0f} s")
    fit = Fit(case)
    fitted = fit.fitted(seconds)
    problem = ArticulatedProblem.of(bound(judged, fit.compiled), found.model, judged.validation)
    ours = errors_of(problem, found.final.hypothesis, found.final.vector)
    theirs = fit.errors(fitted, judged) * FreeRuns(problem).sizes
    return [so101_row(1e3 * ours, 1e3 * theirs, len(fit.settings), seconds)]


def so101_row(ours: Array, theirs: Array, parameters: int, seconds: float) -> Row:
    """The median over the joints of the RMS errors (n_records, n_joints) [mrad] of a middle record, theirs over ours."""
    pairs = np.array([np.median(ours, axis=0), np.median(theirs, axis=0)]).T
    alone = ", ".join(f"{one:.3g} of {peer:.3g}" for one, peer in pairs)
    told = (
        f"mrad: ours {np.median(pairs[:, 0]):.3g}, theirs {np.median(pairs[:, 1]):.3g} ({parameters} parameters), joint by joint {alone}; "
        f"{len(ours)} motions, {seconds:.0f} s each"
    )
    name = "SO-101: RMS error of unseen motions, median over joints, against mujoco.sysid"
    return _row(name, pairs, "≥ 1.43", told, lambda drawn: float(np.divide(*np.median(drawn, axis=0)[::-1])))


def _row(
    name: str,
    pairs: Array,
    limit: str,
    told: str,
    ratio: Callable[[Array], float] = lambda drawn: float(np.median(drawn[:, 1] / drawn[:, 0])),
) -> Row:
    """Theirs over ours of pairs (n, 2), and its spread over a bootstrap."""
    rng = np.random.default_rng(SEED)
    draws = [ratio(pairs[rng.integers(len(pairs), size=len(pairs))]) for _ in range(DRAWS)]
    low, high = np.percentile(draws, [10, 90])
    return Row(name, ratio(pairs), (float(low), float(high)), limit, told, {"pairs": pairs.tolist()})
