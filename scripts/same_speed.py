"""Hold the speed of two checkouts against each other: stepping with native laws, and campaigns.

    python scripts/same_speed.py --before ../before [--after .] [--rounds 15] [--tasks native] [--json]

Each checkout has one process; the two take turns in alternating order, so that what else the machine does falls on both. The work is
stated here, not taken from the checkouts' own benchmarks, which may have changed. The ratio is that of the pairs' processor times,
after over before; its interval is a percentile bootstrap of the median over the pairs.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table
from same_verdicts import Worker, work
from scipy.stats import bootstrap

ROOT = Path(__file__).resolve().parent.parent
STEPS = 40_000
PLAN: dict[str, Any] = {
    "name": "speed",
    "seed": 1,
    "records": 64,
    "duration": 10.0,
    "sample_rate": 1000.0,
    "records_per_part": 8,
    "channels": ["shaker", "displacement", "velocity", "carriage.gap/force"],
    "rigs": [{
        "rig": "sdof",
        "structure": {"stiffness": {"carriage": {"log_uniform": [800.0, 3000.0]}}},
        "elements": [
            {"law": "gap", "joints": ["carriage"], "parameters": {"clearance": {"uniform": [0.001, 0.008]}}},
            {"law": "bouc_wen", "joints": ["carriage"], "parameters": {"A": {"uniform": [300.0, 1500.0]}}},
        ],
    }],
    "excitations": [{"signals": {"shaker": {"type": "band_limited_noise", "cutoff": 40.0, "rms": 20.0}}}],
}  # fmt: skip


@dataclass
class Args:
    """Hold the speed of two checkouts against each other."""

    before: Path
    """Checkout to compare with."""
    after: Path = ROOT
    """Checkout that was changed."""
    tasks: tuple[str, ...] = ("native", "joint", "campaign")
    """Work to be timed."""
    rounds: int = 15
    """Pairs of timed runs."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Ratio:
    """Processor time after over before.

    Attributes:
        task: Work.
        ratio: Median over the pairs.
        ci95: 95 % interval of that median.
        seconds: Least time before and after [s].
    """

    task: str
    ratio: float
    ci95: tuple[float, float]
    seconds: tuple[float, float]


def _stepping(rig: Any) -> Callable[[], None]:
    import mujoco

    model = rig.model

    def run() -> None:
        data = mujoco.MjData(model)
        data.qvel[0] = 0.3
        mujoco.mj_step(model, data, STEPS)

    return run


def _native() -> Callable[[], None]:
    from bench import Element, sdof_rig

    gap = Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003)
    hysteresis = Element.of("bouc_wen", "carriage", A=800.0, beta=60.0, gamma=40.0, n=1.0)
    return _stepping(sdof_rig(gap, hysteresis, mass=2.0, stiffness=1500.0, damping=4.0, integrator="RK4"))


def _joint() -> Callable[[], None]:
    from bench import joint_rig

    return _stepping(joint_rig(integrator="RK4"))


def _campaign() -> Callable[[], None]:
    from bench.campaign import plan_from_dict, run_campaign

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            run_campaign(plan_from_dict(PLAN), Path(folder) / "out", threads=1)

    return run


TASKS = {"native": _native, "joint": _joint, "campaign": _campaign}
_ready: dict[str, Callable[[], None]] = {}


def _answer(question: dict[str, Any]) -> dict[str, Any]:
    name = question["task"]
    if name not in _ready:
        _ready[name] = TASKS[name]()
        _ready[name]()
    begun = time.process_time()
    _ready[name]()
    return {"seconds": time.process_time() - begun}


def compare(task: str, before: Worker, after: Worker, rounds: int) -> Ratio:
    """Time a task in both checkouts by turns.

    Args:
        task: Name of the work, a key of `TASKS`.
        before, after: Processes of the two checkouts.
        rounds: Pairs.
    """
    seconds = np.empty((rounds, 2))
    for number in range(-1, rounds):
        order = [(0, before), (1, after)]
        for column, worker in order if number % 2 else order[::-1]:
            seconds[max(number, 0), column] = worker.ask({"task": task})["seconds"]
    ratios = seconds[:, 1] / seconds[:, 0]
    interval = bootstrap(
        (ratios,), np.median, method="percentile", rng=np.random.default_rng(0)
    ).confidence_interval
    least = seconds.min(axis=0)
    return Ratio(
        task,
        float(np.median(ratios)),
        (float(interval.low), float(interval.high)),
        (float(least[0]), float(least[1])),
    )


def main(args: Args) -> None:
    """Compare and print."""
    unknown = sorted(set(args.tasks) - set(TASKS))
    if unknown:
        raise SystemExit(f"error: unknown task {unknown[0]!r}; known: {', '.join(TASKS)}")
    before, after = Worker(args.before, __file__), Worker(args.after, __file__)
    ratios = [compare(task, before, after, args.rounds) for task in args.tasks]
    before.close()
    after.close()
    if args.json:
        print(json.dumps([asdict(row) for row in ratios], indent=1))
        return
    table = Table("work", "after / before", "95 %", "before s", "after s")
    for row in ratios:
        table.add_row(
            row.task,
            f"{row.ratio:.3f}",
            "{:.3f} to {:.3f}".format(*row.ci95),
            *(f"{s:.3f}" for s in row.seconds),
        )
    Console().print(table)


if __name__ == "__main__":
    if sys.argv[1:] == ["--worker"]:
        work(_answer)
    else:
        main(tyro.cli(Args))
