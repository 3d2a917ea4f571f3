"""Training of policies that choose among plans: plans for drawn rigs, what each leaves to know of many others, and a network that tells.

Stage by stage, on records that the policy makes so far (rigs are run under it anew for each decision, so that the network learns where it
will be asked): for some rigs the best rest of the test is searched for, as the planner does, from where the record ends; for many others,
all these plans are simulated, and the error that each would leave is computed; a network learns to tell these errors from the record
with noise on it. Nothing is reinforced: the values are known, each choice at each rig.

Importing this module imports torch (extra `rl`); policies run without.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from bench.errors import FileFormatError
from bench.excitation import (
    Experiment,
    Family,
    Planner,
    PlanPolicy,
    RigPrior,
    controls_from,
    design,
)
from bench.excitation.background import errors_left, with_background
from bench.excitation.closed_loop import disturbances, run_policy
from bench.excitation.ensemble import available_threads
from bench.excitation.information import noise_vector
from bench.excitation.station import Desk, Station
from bench.files import replacing, write_text

from .background import background_of
from .base import setup_of
from .plan_network import TriedPlans, learned
from .sb3 import KINDS
from .training_plan import TASKS, PlanTraining

Showing = Callable[[str, float], None]


@dataclass(frozen=True)
class PlanTrainingSettings:
    """Numbers of `envs.plan_training`."""

    margin: float = 0.97
    """Of the limits of stroke and velocity that a plan may use on a rig; noise of the sensors comes on top."""
    design_draws: int = 24
    """Rigs that the opening, a D-optimal multisine, is made for, as in the evaluation."""


SETTINGS = PlanTrainingSettings()


def train_plans(
    training: PlanTraining, folder: Path, told: Showing = lambda text, share: None, *, resume: bool = True
) -> PlanPolicy:
    """Train a policy of plans, or go on where the training was stopped: after its opening, plans tried, or network of a decision.

    Args:
        training: What to train.
        folder: Where what is done so far is kept.
        told: Called with a label and the share done.
        resume: Go on with what is there; otherwise it is done anew.

    Raises:
        FileFormatError: The folder holds another training.
    """
    if not resume:
        for path in (folder / "training.json", folder / "opening.npz", *folder.glob("tried-*.npz")):
            path.unlink(missing_ok=True)
    begun = time.monotonic()
    torch.set_num_threads(max(1, available_threads() // 2))
    _claim(training, folder)
    laboratory = _PlanBench(training)
    opening = _kept(folder / "opening.npz", lambda: {"opening": laboratory.opening(told)})["opening"]
    policy = PlanPolicy(training.task, laboratory.station, opening, ())
    for i, share in enumerate(training.decisions):
        window = round(share * laboratory.station.n_windows)
        label = f"decision {i + 1} of {len(training.decisions)}"
        kept = _kept(
            folder / f"tried-{i}.npz",
            lambda policy=policy, window=window, i=i, label=label: laboratory.tried(
                policy, window, i, lambda text, part: told(f"{label}: {text}", part)
            )._asdict(),
        )
        stage = learned(
            training, laboratory.station, window, TriedPlans(**kept),
            lambda part, label=label: told(f"{label}: network", part),
        )  # fmt: skip
        identifier, arguments = TASKS[training.task]
        about = {
            "environment": identifier,
            "arguments": arguments,
            "plan": asdict(training),
            "seconds": round(time.monotonic() - begun, 1),
            "steps": training.steps,
        }
        policy = PlanPolicy(training.task, laboratory.station, opening, (*policy.stages, stage), about)
    policy.save(folder / "best.npz")
    return policy


def _claim(training: PlanTraining, folder: Path) -> None:
    path = folder / "training.json"
    wanted = json.loads(json.dumps(asdict(training)))
    if path.is_file() and (found := json.loads(path.read_text(encoding="utf-8"))) != wanted:
        raise FileFormatError(
            f"{folder} holds the training of another plan ({found}); take another folder or start afresh"
        )
    write_text(path, json.dumps(wanted, indent=1))


def _kept(path: Path, made: Callable[[], dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Arrays of a file, made and written where there is none."""
    if not path.is_file():
        arrays = made()
        with replacing(path) as temporary:
            np.savez(temporary, allow_pickle=False, **arrays)  # pyrefly: ignore[bad-argument-type]
    with np.load(path) as kept:
        return {name: kept[name] for name in kept.files}


class _PlanBench:
    """Where plans are made and tried."""

    def __init__(self, training: PlanTraining) -> None:
        identifier, arguments = TASKS[training.task]
        self.training = training
        self.setup = setup_of(KINDS[identifier], dict(arguments))
        self.station: Station = self.setup.station()
        prior = self.setup.questions[0]
        assert isinstance(prior, RigPrior)
        self.prior = prior
        self.background = background_of(self.setup) if training.backgrounds else ()
        self.real = tuple(
            Family(with_background(h, self.background), self.station.channels, self.station.actuators)
            for h in prior.hypotheses
        )
        self.noise = noise_vector(self.station.noise, self.station.channels)
        self.scale = np.array([self.station.scale[name] for name in self.station.channels])
        self.force = np.array([self.station.limits.force[name] for name in self.station.actuators])

    def opening(self, told: Showing) -> NDArray[np.float32]:
        """A D-optimal multisine, as actions ``(n_windows, width)``."""
        told("opening", 0.0)
        rng = np.random.default_rng(self.training.seed)
        draws = self.prior.draws(SETTINGS.design_draws, rng)
        experiment = Experiment(self.prior, self.setup.noise, self.setup.limits, draws)
        plan = design(
            "d_optimal", experiment, duration=self.setup.duration, band=self.setup.band, rng=rng,
            evaluations=self.training.evaluations,
            progress=lambda n, _: told("opening", n / self.training.evaluations),
        )  # fmt: skip
        return self.knots(controls_from(plan)[None])[0]

    def knots(self, controls: NDArray[np.float64]) -> NDArray[np.float32]:
        """Actions ``(m, n_windows, width)`` of commands ``(m, n_samples, n_actuators)``: those at the end of each window."""
        ends = controls[:, self.station.n_steps - 1 :: self.station.n_steps]
        return np.clip(ends / self.force, -1.0, 1.0).astype(np.float32)

    def commands(self, actions: NDArray[np.float32]) -> NDArray[np.float64]:
        """Commands ``(m, n_samples, n_actuators)`` of the actions of whole tests ``(m, n_windows, width)``, within force and energy."""
        m, n_windows, _ = actions.shape
        desk, places = Desk(self.station, m), np.arange(m)
        windows = [desk.commands(places, actions[:, w].astype(float))[0] for w in range(n_windows)]
        return np.concatenate(windows, axis=1)

    def rigs(self, count: int, key: tuple[int, ...]) -> list[NDArray[np.float64]]:
        """Coordinates of rigs drawn from each hypothesis, then of their background, zeros where one has none ``(count, p + b)``."""
        rng, bound = np.random.default_rng((self.training.seed, *key)), np.sqrt(3.0)
        bare = np.diff(np.floor(self.training.backgrounds * np.arange(count + 1))) == 0.0
        drawn = []
        for family in self.real:
            points = rng.uniform(-bound, bound, (count, family.n_parameters))
            points[bare, family.n_parameters - len(self.background) :] = 0.0
            drawn.append(points)
        return drawn

    def parted(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Coordinates of rigs without those of their background ``(…, p)``, and whether they have one ``(…)``."""
        p = points.shape[-1] - len(self.background)
        return points[..., :p], np.asarray(np.any(points[..., p:] != 0.0, axis=-1))

    def tried(self, policy: PlanPolicy, window: int, stage: int, told: Showing) -> TriedPlans:
        """Plans for some rigs, and what each leaves to know of others, from where the policy has brought their records."""
        with threadpool_limits(1, user_api="blas"):  # small products, beside threads of our own
            plans = self._plans(policy, window, stage, told)
            record, values = self._values(policy, window, stage, plans, told)
        return TriedPlans(plans, record, values)

    def _plans(self, policy: PlanPolicy, window: int, stage: int, told: Showing) -> NDArray[np.float32]:
        n, begin = self.training.plans, window * self.station.n_steps
        opening, share = self.commands(policy.opening[None])[0], window / self.station.n_windows
        planners = [
            Planner(self.prior, self.station, opening, (share,), self.training.generations, background)
            for background in dict.fromkeys(((), self.background))
        ]
        each = -(-n // len(self.real))
        jobs = []
        for k, points in enumerate(self.rigs(each, (stage, 1))):
            rng = np.random.default_rng((self.training.seed, stage, 2, k))
            runs = run_policy(policy, self.real[k].packed(points), disturbances(self.station, each, rng))
            rows = zip(*self.parted(points), runs.records.controls, strict=True)
            jobs += [(k, *row, i) for i, row in enumerate(rows)]

        def plan(job: tuple) -> NDArray[np.float64]:
            k, x, backed, controls, i = job
            seed = self.training.seed + 1000 * k + i
            return planners[int(backed)].continuation(k, x, controls.copy(), begin, seed)

        jobs = sorted(jobs, key=lambda job: job[-1])[:n]
        whole = np.zeros((n, self.station.n_samples, len(self.force)))
        for i, rest in enumerate(_spread(plan, jobs, lambda part: told("plans", part))):
            whole[i, begin:] = rest
        return self.knots(whole)[:, window:]

    def _values(
        self, policy: PlanPolicy, window: int, stage: int, plans: NDArray[np.float32], told: Showing
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        record, values = [], []
        count = self.training.rigs
        for k, points in enumerate(self.rigs(count, (stage, 3))):
            rng = np.random.default_rng((self.training.seed, stage, 4, k))
            runs = run_policy(policy, self.real[k].packed(points), disturbances(self.station, count, rng))
            actions = self.knots(runs.records.controls)
            some = min(self.training.tried, len(plans))
            drawn = [rng.choice(len(plans), some, replace=False) for _ in range(count)]

            def tried(i: int, k=k, points=points, actions=actions, drawn=drawn) -> NDArray[np.float32]:
                rest = np.concatenate([actions[i, None, window:], plans[drawn[i]]])
                past = np.broadcast_to(actions[i, :window], (len(rest), window, self.station.width))
                commands = self.commands(np.concatenate([past, rest], axis=1))
                values = np.full(1 + len(plans), np.nan, dtype=np.float32)
                values[np.append(0, 1 + drawn[i])] = self._value(k, points[i], commands)
                return values

            part = _spread(tried, range(count), lambda p, k=k: told("tried", (k + p) / len(self.real)))
            values.append(np.stack(list(part)))
            shown = np.clip(runs.ideal / self.scale, -1.0, 1.0).reshape(count, self.station.n_windows, -1)
            record.append(np.concatenate([shown, actions], axis=2)[:, :window].astype(np.float32))
        return np.concatenate(record), np.concatenate(values)

    def _value(
        self, kind: int, point: NDArray[np.float64], commands: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Logarithm of the error that each excitation leaves of a rig ``(k,)``; 0 where it passes a limit."""
        x, backed = self.parted(point)
        left = errors_left(self.real[kind], x, commands, self.noise)
        reached = np.max(np.nan_to_num(Desk(self.station, 1).reached(left.motion), nan=np.inf), axis=1)
        error = np.log(left.backed if backed else left.bare)
        return np.where(reached > SETTINGS.margin, 0.0, error).astype(np.float32)


def _spread(
    task: Callable[[Any], NDArray[Any]], items: Any, told: Callable[[float], None]
) -> list[NDArray[Any]]:
    """What a task makes of each item, in order, over all threads."""
    made = []
    with ThreadPoolExecutor(available_threads()) as pool:
        for result in pool.map(task, items):
            made.append(result)
            told(len(made) / len(items))
    return made
