"""Policies trained for different rewards, without and with a memory, beside a planner and open-loop designs.

They are held against each other on held-out rigs without and with a background.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from evaluate_excitation import interval, middle
from numpy.typing import NDArray

from bench.excitation import PacedPlanner, Planner, PlanPolicy, Policy, RigPrior, estimate
from bench.excitation.closed_loop import Runs, disturbances, run_commands, run_policy
from bench.excitation.stepping import Packed
from bench.files import write_text
from envs.background import background_of
from envs.setups import Setup
from policies.judge import HELD_OUT, fingerprint

from .trials import kinds_of, open_loop

Source = Policy | PlanPolicy | PacedPlanner | Planner | NDArray[np.float64]
BASELINES = ("random_multisine", "schroeder", "crest_multisine", "log_sweep", "prbs", "d_optimal")


def trained(
    task: str,
    rewards: tuple[str, ...],
    memories: tuple[int, ...],
    seeds: int,
    steps: int,
    folder: Path,
    tell: Callable[[str], None],
) -> dict[str, Policy]:
    """A policy for each reward, memory and seed; stopped, the same call goes on.

    Args:
        task: sdof or joint.
        rewards: "practice", "error", or those of the registered environments.
        memories: Units of the memory, 0 for none.
        seeds: Seeds from 0 on.
        steps: Windows of each training.
        folder: Checkpoints, in a folder for each.
        tell: Called with what is done.
    """
    from envs.training import Trainer
    from envs.training_plan import TrainingPlan

    policies = {}
    for reward, memory, seed in product(rewards, memories, range(seeds)):
        plan = TrainingPlan(task, steps=steps, seed=seed, reward=reward, memory=memory)
        label = f"policy for {reward}, {f'memory of {memory}' if memory else 'no memory'}, seed {seed}"
        trainer = Trainer(plan, folder / f"{task}-{reward}-{memory}-{seed}")
        policies[label] = trainer.run(
            progress=lambda text, share, of=label: tell(f"{of}: {100 * share:.0f} %, {text}")
        )
    return policies


def contest(
    setup: Setup,
    policies: Mapping[str, Policy | PlanPolicy],
    *,
    seeds: int,
    rigs: int,
    planner: bool = True,
    folder: Path,
    tell: Callable[[str], None],
) -> list[dict[str, Any]]:
    """One row a held-out rig and method: what identification leaves, and how many windows passed a limit.

    Stopped, the same call goes on after the last seed that was done.

    Args:
        setup: The laboratory.
        policies: Policies by name.
        seeds: Seeds of rigs.
        rigs: Rigs a seed, each without and with its background.
        planner: Also the planners, those at the pace of the test among them, and those that design for backgrounds.
        folder: Where the rows of every seed are kept.
        tell: Called with what is done.
    """
    prior, station = setup.questions[0], setup.station()
    assert isinstance(prior, RigPrior)
    tell("designing")
    opened = open_loop(setup, np.random.default_rng(HELD_OUT - 1))
    sources: dict[str, Source] = {**opened, **policies}
    if planner:
        # what a D-optimal design tells much of, a background spoils
        backed = (" for backgrounds", background_of(setup), opened["crest_multisine"])
        for suffix, background, opening in (("", (), opened["d_optimal"]), backed):
            sources[f"planner{suffix}"] = Planner(prior, station, opening, background=background)
            sources[f"paced planner{suffix}"] = PacedPlanner(prior, station, opening, background=background)
    made_with = json.dumps([str(setup.recipe), rigs, {name: _made_of(own) for name, own in sources.items()}])
    digest = hashlib.sha256(made_with.encode()).hexdigest()[:12]
    rows = []
    for seed in range(seeds):
        kept = folder / f"rows-{digest}-seed-{seed}.json"
        if not kept.is_file():
            write_text(kept, json.dumps(_rows_of(setup, sources, seed, rigs, tell)))
        rows += json.loads(kept.read_text(encoding="utf-8"))
    return rows


def _made_of(source: Source) -> str:
    """What tells a method from others of its name."""
    background = str(source.background) if isinstance(source, Planner | PacedPlanner) else ""
    return fingerprint([source] if isinstance(source, np.ndarray) else source) + background


def _rows_of(
    setup: Setup, sources: Mapping[str, Source], seed: int, rigs: int, tell: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Rows of the rigs of a seed."""
    station, rows = setup.station(), []
    noise = np.array([station.noise[name] for name in station.channels])
    rng = np.random.default_rng(HELD_OUT + seed)
    for kind in kinds_of(setup, rigs, rng):
        n = len(kind.coordinates)
        for real in (False, True):
            packed = kind.real.packed(np.concatenate([kind.coordinates, real * kind.background], axis=1))
            disturbance = disturbances(station, n, rng)
            for name, source in sources.items():
                tell(f"seed {seed}, {kind.family.hypothesis.name}: {name}")
                runs = _run(source, setup, packed, disturbance, seed)
                off = estimate(kind.family, runs.records, noise).coordinates - kind.coordinates
                rows += [
                    {
                        "method": name, "seed": seed, "kind": kind.family.hypothesis.name, "background": real,
                        "error": float(np.sqrt(np.mean(off[i] ** 2))),
                        "violations": int(runs.violations[i]), "windows": int(runs.windows[i]),
                    }
                    for i in range(n)
                ]  # fmt: skip
    return rows


def _run(source: Source, setup: Setup, packed: Packed, disturbance: NDArray[np.float64], seed: int) -> Runs:
    if isinstance(source, Planner):
        return source.run(packed, disturbance, seed=seed)
    if isinstance(source, np.ndarray):
        return run_commands(setup.station(), source, packed, disturbance)
    return run_policy(source, packed, disturbance)


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Interquartile means with 95 % intervals, and ratios to the best open-loop method, without and with a background, by kind."""
    kinds = ["all", *dict.fromkeys(row["kind"] for row in rows)]
    return {
        where: {kind: _group([r for r in rows if r["background"] is real and kind in {"all", r["kind"]}]) for kind in kinds}
        for where, real in (("without background", False), ("with background", True))
    }  # fmt: skip


def _group(rows: list[dict[str, Any]]) -> dict[str, Any]:
    methods = list(dict.fromkeys(row["method"] for row in rows))
    of = {name: [row for row in rows if row["method"] == name] for name in methods}
    errors = {name: np.array([row["error"] for row in mine]) for name, mine in of.items()}
    seeds = np.array([row["seed"] for row in of[methods[0]]])
    best = min(BASELINES, key=lambda name: middle(errors[name]))
    entry = {}
    for name, mine in of.items():
        pair = np.stack([errors[name], errors[best]], axis=1)
        entry[name] = {
            "error": middle(errors[name]),
            "interval": interval(pair, seeds, lambda x: middle(x[:, 0])),
            "ratio": middle(errors[name]) / middle(errors[best]),
            "ratio_interval": interval(pair, seeds, lambda x: middle(x[:, 0]) / middle(x[:, 1])),
            "best_open_loop": best,
            "violations_percent": 100.0
            * sum(r["violations"] for r in mine)
            / sum(r["windows"] for r in mine),
            "rigs": len(mine),
        }
    return entry
