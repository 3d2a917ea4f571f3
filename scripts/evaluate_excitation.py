"""Hold excitation methods and trained policies against each other on held-out rigs, at equal limits and by the same identification.

python scripts/evaluate_excitation.py sdof --json out/sdof.json
python scripts/evaluate_excitation.py rivals --seeds 10 --rigs 12

Identification: error of the identified parameters, root mean square over a rig's parameters, in prior standard deviations.
Rivals: seconds of the record after which the true explanation has a posterior probability of 99 %.
Interquartile means over rigs with 95 % bootstrap intervals. Every force peak, energy, stroke and duration is the same; a limit
switch ends a test. Stopped or killed, it goes on where it was.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from policies.judge import HELD_OUT, Judge, Source, fingerprint
from policies.progress import progress_bar
from rich.console import Console
from rich.table import Table
from scipy.stats import trim_mean

from bench.errors import BenchError
from bench.excitation import (
    METHODS,
    Experiment,
    PacedPlanner,
    RigPrior,
    RivalPlanner,
    Rivals,
    controls_from,
    design,
    find_policy,
    policy_names,
)
from bench.excitation.ensemble import available_threads
from bench.excitation.planner import Planner
from bench.files import replacing, write_text
from envs.setups import Setup, discrimination_setup, joint_setup, rival_experiment, sdof_setup

DESIGN_DRAWS = {"sdof": 24, "joint": 16, "rivals": 16, "joint_rivals": 16}
"""Prior draws that designs are made for: enough that designs keep the stroke on rigs never seen."""
RESAMPLES = 2000


@dataclass
class Args:
    """Evaluate.

    Attributes:
        task: sdof, joint, rivals (on the SDOF rig) or joint_rivals.
        policies: Policies by name or file; by default the one that comes with the task, if there is one.
        planner: Also the planners.
        methods: Baselines.
        seeds: Seeds.
        rigs: Rigs a seed.
        evaluations: Signals that the D-optimal search weighs.
        workers: Processes; every core by default.
        out: Folder of designs and partial results.
        json: File for the figures; "-" prints them.
    """

    task: tyro.conf.Positional[str] = "sdof"
    policies: tuple[str, ...] = ()
    planner: bool = True
    methods: tuple[str, ...] = METHODS
    seeds: int = 10
    rigs: int = 50
    evaluations: int = 1600
    workers: int = field(default_factory=available_threads)
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("out/excitation")
    json: Path | None = None


def setup_of(task: str) -> Setup:
    """The laboratory of a task."""
    makers = {
        "sdof": sdof_setup,
        "joint": joint_setup,
        "rivals": lambda: discrimination_setup(
            "sdof", ("gap_cubic", "presliding_bouc_wen", "coulomb_stribeck")
        ),
        "joint_rivals": lambda: discrimination_setup("joint"),
    }
    if task not in makers:
        raise SystemExit(f"evaluate_excitation: no task '{task}'; known: {', '.join(makers)}")
    return makers[task]()


def wide_experiments(setup: Setup, task: str) -> list[Experiment]:
    """The questions on more prior draws than the environments' rewards use."""
    rng, count = np.random.default_rng(HELD_OUT - 1), DESIGN_DRAWS[task]
    return [
        rival_experiment(setup.place, question, count // 2)
        if isinstance(question, Rivals)
        else Experiment(question, setup.noise, setup.limits, question.draws(count, rng))
        for question in setup.questions
    ]


def designed(
    args: Args, method: str, setup: Setup, experiments: list[Experiment]
) -> list[NDArray[np.float64]]:
    """Commands of a method for each question; kept in a file."""
    path = args.out / args.task / f"design-{method}-{args.evaluations}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return [kept[f"question_{i}"] for i in range(len(experiments))]
    commands = []
    for experiment in experiments:
        plan = design(
            method, experiment, duration=setup.duration, band=setup.band, rng=np.random.default_rng(1),
            evaluations=args.evaluations,
        )  # fmt: skip
        commands.append(controls_from(plan))
    with replacing(path) as temporary:
        np.savez_compressed(temporary, **{f"question_{i}": u for i, u in enumerate(commands)})  # pyrefly: ignore[bad-argument-type]
    return commands


def middle(values: NDArray[np.float64]) -> float:
    """Interquartile mean."""
    return float(trim_mean(values, 0.25))


def interval(rows: NDArray[np.float64], seeds: NDArray[np.int64], statistic: Any) -> list[float]:
    """95 % bootstrap interval of a statistic of paired columns ``(n, k)``, rigs resampled within each seed."""
    rng = np.random.default_rng(0)
    places = [np.flatnonzero(seeds == seed) for seed in np.unique(seeds)]
    found = []
    for _ in range(RESAMPLES):
        drawn = np.concatenate([rng.choice(place, len(place)) for place in places])
        found.append(statistic(rows[drawn]))
    return [float(x) for x in np.quantile(found, [0.025, 0.975])]


def summary(results: dict[str, list[dict[str, Any]]], baselines: tuple[str, ...]) -> dict[str, Any]:
    """Figures of all methods, over all rigs and by kind (identification) or question (rivals)."""
    first = next(iter(results.values()))
    measure, by = ("seconds", "question") if "seconds" in first[0] else ("error", "kind")
    groups = ["all", *dict.fromkeys(row[by] for row in first)]
    document: dict[str, Any] = {
        "measure": measure,
        "unit": "s" if measure == "seconds" else "prior standard deviations",
    }
    for group in groups:
        chosen = {name: [row for row in rows if group in {"all", row[by]}] for name, rows in results.items()}
        seeds = np.array([row["seed"] for row in next(iter(chosen.values()))])
        columns = {name: np.array([row[measure] for row in rows]) for name, rows in chosen.items()}
        entry: dict[str, Any] = {}
        for name, rows in chosen.items():
            entry[name] = {
                "middle": middle(columns[name]),
                "interval": interval(columns[name][:, None], seeds, lambda x: middle(x[:, 0])),
                "violations_percent": 100.0
                * sum(r["violations"] for r in rows)
                / sum(r["windows"] for r in rows),
                "stopped_percent": 100.0 * float(np.mean([r["stroke"] > 1.0 for r in rows])),
                "rigs": len(rows),
            }
            if measure == "seconds":
                entry[name]["wrong_percent"] = 100.0 * float(np.mean([r["wrong"] for r in rows]))
        rivals = [name for name in baselines if name in columns]
        if rivals:
            best = min(rivals, key=lambda name: entry[name]["middle"])
            for name in results:
                if name not in baselines:
                    pair = np.stack([columns[name], columns[best]], axis=1)
                    entry[name]["best_baseline"] = best
                    entry[name]["ratio"] = entry[name]["middle"] / entry[best]["middle"]
                    entry[name]["ratio_interval"] = interval(
                        pair, seeds, lambda x: middle(x[:, 0]) / middle(x[:, 1])
                    )
        document[group] = entry
    return document


def main() -> int:
    """Design, run, identify, compare."""
    args = tyro.cli(Args, description=__doc__)
    try:
        document = evaluate(args)
    except BenchError as error:
        print(f"evaluate_excitation: {error}", file=sys.stderr)
        return 2
    text = json.dumps(document, indent=1)
    if args.json == Path("-"):
        print(text)
        return 0
    if args.json is not None:
        write_text(args.json, text)
    console = Console()
    for group in (key for key, value in document.items() if isinstance(value, dict)):
        measure = f"{document['measure']} \\[{document['unit']}]"
        table = Table(
            "method", measure, "95 %", "violations %", "of best baseline", title=f"{args.task}: {group}"
        )
        for name, row in document[group].items():
            low, high = row["interval"]
            ratio = f"{row['ratio']:.2f} of {row['best_baseline']}" if "ratio" in row else ""
            table.add_row(
                name,
                f"{row['middle']:.4g}",
                f"{low:.3g} … {high:.3g}",
                f"{row['violations_percent']:.2f}",
                ratio,
            )
        console.print(table)
    return 0


@dataclass(frozen=True)
class Contest:
    """What every process that tests rigs works with; made once in each.

    Attributes:
        judge: Runs and identifies.
        sources: Methods by name: commands of each question, a policy, or a planner.
    """

    judge: Judge
    sources: dict[str, Source]


def contest_of(args: Args, tell: Callable[[str], None] = lambda name: None) -> Contest:
    """Design what is not designed yet, and set up the laboratory.

    Args:
        args: What was asked for.
        tell: Called with the name of each method that is designed.
    """
    setup = setup_of(args.task)
    experiments = wide_experiments(setup, args.task)
    names = args.policies or tuple(name for name in policy_names() if name == args.task)
    sources: dict[str, Source] = {}
    for name in args.methods:
        tell(name)
        sources[name] = designed(args, name, setup, experiments)
    sources |= {f"policy {Path(name).stem}": find_policy(name) for name in names}
    question = setup.questions[0]
    if args.planner and isinstance(question, RigPrior):
        opening = designed(args, "d_optimal", setup, experiments)[0]
        sources["planner"] = Planner(question, setup.station(), opening)
        sources["paced planner"] = PacedPlanner(question, setup.station(), opening)
    elif args.planner:
        asked: list[Any] = experiments  # of rivals, on pairs of draws
        sources["planner"] = [RivalPlanner(e.question, setup.station(), e.draws) for e in asked]
    return Contest(Judge(setup), sources)


def evaluate(args: Args) -> dict[str, Any]:
    """All figures; partial results are kept in `args.out`."""
    with progress_bar(hidden=args.json == Path("-")) as bar:
        task = bar.add_task("designing")
        contest = contest_of(args, lambda name: bar.update(task, description=f"designing {name}"))
        paths = {
            (name, seed): args.out
            / args.task
            / f"{name.replace('/', '_')}-{fingerprint(source)}-{args.rigs}-{seed}.json"
            for name, source in contest.sources.items()
            for seed in range(args.seeds)
        }
        missing = [(name, seed, path) for (name, seed), path in paths.items() if not path.is_file()]
        bar.update(task, description="testing", total=len(paths), completed=len(paths) - len(missing))
        workers = max(1, min(args.workers, len(missing)))
        with ProcessPoolExecutor(workers, get_context("spawn"), _begin, (args,)) as pool:
            for finished in as_completed([pool.submit(_tested, *item) for item in missing]):
                bar.update(task, advance=1, description=finished.result())
    results = {
        name: [
            row
            for seed in range(args.seeds)
            for row in json.loads(paths[name, seed].read_text(encoding="utf-8"))
        ]
        for name in contest.sources
    }
    return {"task": args.task, "seeds": args.seeds, "rigs": args.rigs, **summary(results, args.methods)}


_own: list[tuple[Args, Contest]] = []  # of a process that tests rigs


def _begin(args: Args) -> None:
    _own[:] = [(args, contest_of(args))]


def _tested(name: str, seed: int, path: Path) -> str:
    """Test a seed's rigs by a method, keep the rows, and return the name."""
    args, contest = _own[0]
    rows = contest.judge.rows(contest.sources[name], seed, args.rigs)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(rows))
    return name


if __name__ == "__main__":
    sys.exit(main())
