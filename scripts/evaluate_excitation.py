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
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from scipy.stats import trim_mean

from bench.errors import BenchError
from bench.excitation import (
    METHODS,
    Experiment,
    Family,
    Policy,
    RigPrior,
    RivalPlanner,
    Rivals,
    controls_from,
    design,
    find_policy,
    policy_names,
)
from bench.excitation.closed_loop import Runs, disturbances, run_commands, run_policy
from bench.excitation.ensemble import available_threads
from bench.excitation.estimation import Records, estimate
from bench.excitation.planner import Planner
from bench.excitation.sequential import SequentialPlanner
from bench.excitation.stepping import Packed
from bench.files import replacing, write_text
from envs.setups import Setup, discrimination_setup, joint_setup, rival_experiment, sdof_setup

HELD_OUT = 7_000_000  # seeds of rigs and noise; no training draws from them
DESIGN_DRAWS = {"sdof": 24, "joint": 16, "rivals": 16, "joint_rivals": 16}
"""Prior draws that designs are made for: enough that designs keep the stroke on rigs never seen."""
CERTAIN = float(np.log(99.0))
TIMES = (*np.arange(0.1, 1.95, 0.1), *np.arange(2.0, 3.0, 0.25), *np.arange(3.0, 8.25, 0.5))
"""Times at which rivals are judged, as parts of an eighth of the test."""
RESAMPLES = 2000


@dataclass
class Args:
    """Evaluate.

    Attributes:
        task: sdof, joint, rivals (on the SDOF rig) or joint_rivals.
        policies: Policies by name or file; by default the one that comes with the task, if there is one.
        planner: Also the planner.
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
        np.savez_compressed(temporary, **{f"question_{i}": u for i, u in enumerate(commands)})
    return commands


def hidden(setup: Setup, seed: int, rigs: int) -> Iterator[tuple[int, str, NDArray[np.float64], Any]]:
    """Held-out rigs of a seed by question and kind: question, kind, coordinates ``(m, p)``, hypothesis."""
    rng = np.random.default_rng(HELD_OUT + seed)
    kinds = [
        (i, h)
        for i, question in enumerate(setup.questions)
        for h in (
            question.hypotheses if isinstance(question, RigPrior) else (question.first, question.second)
        )
    ]
    for k, (i, hypothesis) in enumerate(kinds):
        count = rigs // len(kinds) + (k < rigs % len(kinds))
        yield (
            i,
            hypothesis.name,
            rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), (count, len(hypothesis.parameters))),
            hypothesis,
        )


Source = Policy | Planner | list[RivalPlanner] | list[NDArray[np.float64]]


class Judge:
    """Runs tests on held-out rigs and identifies them."""

    def __init__(self, setup: Setup) -> None:
        self.setup, self.station = setup, setup.station()
        self.noise = np.array(list(setup.noise.values()))
        self._families: dict[int, Family] = {}

    def family(self, hypothesis: Any) -> Family:
        """The rigs of a hypothesis."""
        if id(hypothesis) not in self._families:
            self._families[id(hypothesis)] = Family(hypothesis, self.station.channels, self.station.actuators)
        return self._families[id(hypothesis)]

    def rows(self, source: Source, seed: int, rigs: int) -> list[dict[str, Any]]:
        """One row a rig."""
        result = []
        for question, kind, coordinates, hypothesis in hidden(self.setup, seed, rigs):
            if not len(coordinates):
                continue
            family = self.family(hypothesis)
            rng = np.random.default_rng([HELD_OUT + seed, question])
            noise = disturbances(self.station, len(coordinates), rng)
            packed = family.packed(coordinates)
            runs = self._run(source, question, packed, noise, seed)
            asked = self.setup.questions[question]
            found = (
                self._seconds(asked, hypothesis, runs)
                if isinstance(asked, Rivals)
                else self._error(family, coordinates, runs)
            )
            for i, figures in enumerate(found):
                result.append(
                    {
                        "seed": seed,
                        "question": asked.name if isinstance(asked, Rivals) else "",
                        "kind": kind,
                        "violations": int(runs.violations[i]),
                        "windows": int(runs.windows[i]),
                        "stroke": float(runs.reached[i, 0]),
                        "energy": float(runs.energy[i]),
                        **figures,
                    }
                )
        return result

    def _run(
        self, source: Source, question: int, packed: Packed, noise: NDArray[np.float64], seed: int
    ) -> Runs:
        """Tests on rigs of which a question is asked."""
        if isinstance(source, Policy):
            return run_policy(source, packed, noise, question=question)
        own = source if isinstance(source, Planner) else source[question]
        if isinstance(own, SequentialPlanner):
            return own.run(packed, noise, seed=seed)
        return run_commands(self.station, own, packed, noise)

    def _error(self, family: Family, truth: NDArray[np.float64], runs: Runs) -> list[dict[str, Any]]:
        found = estimate(family, runs.records, self.noise)
        off = found.coordinates - truth
        names = family.hypothesis.names
        return [
            {
                "error": float(np.sqrt(np.mean(row**2))),
                **{f"error of {name}": float(abs(x)) for name, x in zip(names, row, strict=True)},
            }
            for row in off
        ]

    def _seconds(self, rivals: Rivals, truth: Any, runs: Runs) -> list[dict[str, Any]]:
        """Time to certainty [s]; the whole test where the truth never became certain, or the other did first."""
        m, timestep = len(runs.windows), self.station.timestep
        families = [self.family(h) for h in (rivals.first, rivals.second)]
        sign = 1.0 if truth is rivals.first else -1.0
        seconds, wrong = np.full(m, self.station.duration), np.zeros(m, dtype=bool)
        open_ones = np.arange(m)
        near: list[NDArray[np.float64] | None] = [None, None]
        for part in TIMES:
            n = round(part / 8.0 * self.station.n_samples)
            if not open_ones.size:
                break
            all_records = runs.records
            some = Records(
                all_records.controls[open_ones, :n],
                all_records.measured[open_ones, :n],
                np.minimum(all_records.lengths[open_ones], n),
            )
            found = [
                estimate(f, some, self.noise, near=start, candidates=64, kept=2)
                for f, start in zip(families, near, strict=True)
            ]
            odds = sign * (found[0].log_evidence - found[1].log_evidence)
            sure, fooled = odds >= CERTAIN, odds <= -CERTAIN
            seconds[open_ones[sure]] = n * timestep
            wrong[open_ones[fooled]] = True
            ended = (
                runs.records.lengths[open_ones] <= n
            )  # a limit switch ended the record: nothing more to come
            stay = ~(sure | fooled | ended)
            near = [item.coordinates[stay] for item in found]
            open_ones = open_ones[stay]
        return [{"seconds": float(s), "wrong": bool(w)} for s, w in zip(seconds, wrong, strict=True)]


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
    names = args.policies or tuple({args.task} & set(policy_names()))
    sources: dict[str, Source] = {}
    for name in args.methods:
        tell(name)
        sources[name] = designed(args, name, setup, experiments)
    sources |= {f"policy {Path(name).stem}": find_policy(name) for name in names}
    question = setup.questions[0]
    if args.planner and isinstance(question, RigPrior):
        opening = designed(args, "d_optimal", setup, experiments)[0]
        sources["planner"] = Planner(question, setup.station(), opening)
    elif args.planner:
        asked: list[Any] = experiments  # of rivals, on pairs of draws
        sources["planner"] = [RivalPlanner(e.question, setup.station(), e.draws) for e in asked]
    return Contest(Judge(setup), sources)


def evaluate(args: Args) -> dict[str, Any]:
    """All figures; partial results are kept in `args.out`."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), disable=args.json == Path("-")) as bar:
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


def fingerprint(source: Source) -> str:
    """Of a policy's numbers, a planner's settings or commands, so that a partial result belongs to what it was made with."""
    import hashlib

    if isinstance(source, Policy):
        arrays = [*source.weights, *source.biases, source.mean, source.deviation, source.schedule]
    elif isinstance(source, Planner):
        arrays = [source.opening, np.array([*source.decisions, source.generations])]
    elif isinstance(source[0], RivalPlanner):
        first = source[0]
        settings = (first.interval, first.horizon, first.knot, first.generations, first.samples)
        arrays = [np.array([*settings, *(len(planner.draws) for planner in source)])]
    else:
        arrays = source
    judged = [*arrays, np.array(TIMES)]
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in judged)).hexdigest()[:12]


if __name__ == "__main__":
    sys.exit(main())
