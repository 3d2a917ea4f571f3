"""Training of policies with stable-baselines3, from a pumping start, with checkpoints, and their export to plain arrays.

Importing this module imports torch and stable-baselines3 (extra `rl`); policies run without (`bench.excitation.policy`).
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from bench.errors import FileFormatError
from bench.excitation.acting import ActingPolicy
from bench.excitation.policy import Policy
from bench.files import replacing, together, write_bytes, write_text

from .imitation import first_feedback, imitate
from .policy_export import Learner, export
from .practice_vector import PracticeVectorEnv
from .sb3 import KINDS, BenchVecEnv
from .scheduled import Scheduled, scheduled
from .training_plan import SETTINGS, TASKS, TrainingPlan


class Score(NamedTuple):
    """A policy on held-out rigs."""

    steps: int  # windows trained
    seconds: float  # of training
    merit: float  # mean at the end [nat]
    score: float  # merit less costs [nat]
    violations: float  # share of windows with stroke or velocity beyond its limit
    stopped: float  # share of tests that the limit switch ended
    certain: float  # mean time to expected 99 % certainty [s], the duration where not reached (rivals only)


def evaluate(
    policy: ActingPolicy,
    task: str,
    *,
    n: int = 96,
    seed: int = SETTINGS.held_out,
    reward: str = "information",
) -> Score:
    """Run a policy for one test on each of `n` held-out rigs (practice benches).

    Args:
        policy: The policy.
        task: One of `TASKS`.
        n: Number of rigs.
        seed: Seed of the first; counted up.
        reward: "information", or "error", of rigs with a background.
    """
    identifier, arguments = TASKS[task]
    env = PracticeVectorEnv(
        KINDS[identifier], n, autoreset_mode=AutoresetMode.SAME_STEP, reward=reward, **arguments
    )
    observation, _ = env.reset(seed=seed)
    benches = env.benches
    alive = np.ones(n, dtype=bool)
    merit, cost, violated, windows = np.zeros(n), np.zeros(n), 0, 0
    stopped = np.zeros(n, dtype=bool)
    certain = np.full(n, benches.station.duration)
    memory = policy.memory(n)
    for window in range(benches.n_windows):
        outcome = benches.step(np.arange(n), policy.act(observation, memory))
        observation = outcome.observation
        merit = np.where(alive, outcome.info["merit"], merit)
        cost += np.where(alive, outcome.info["cost"], 0.0)
        violated += int(np.sum(outcome.info["violation"] & alive))
        windows += int(alive.sum())
        now = (outcome.info["separated"] >= 1.0) & alive & (certain >= benches.station.duration)
        certain[now] = (window + 1) * benches.n_steps * benches.timestep
        stopped |= alive & (outcome.info["stroke"] > 1.0)
        alive &= ~outcome.terminated
        if not alive.any():
            break
    return Score(
        0,
        0.0,
        float(merit.mean()),
        float((merit - cost).mean()),
        violated / windows,
        float(stopped.mean()),
        float(certain.mean()),
    )


def _environment(plan: TrainingPlan, schedule: NDArray[np.float32]) -> VecNormalize:
    identifier, arguments = TASKS[plan.task]
    practice = plan.reward in {"practice", "error"}
    rest = {**arguments, **({"reward": plan.scored} if practice else {"average": plan.reward})}
    env = BenchVecEnv(identifier, plan.n_envs, practice=practice, **rest)
    env.seed(plan.seed)
    return VecNormalize(Scheduled(env, schedule), gamma=plan.discount)


def _model(plan: TrainingPlan, env: VecNormalize) -> Learner:
    def rate(left: float) -> float:
        return plan.learning_rate * max(left, 0.1)

    units = list(plan.network)
    common: dict[str, Any] = {
        "learning_rate": rate, "gamma": plan.discount, "seed": plan.seed, "device": "cpu"
    }  # fmt: skip
    if plan.algorithm == "sac":
        kwargs = {
            "net_arch": {"pi": units, "qf": [128, 128]},
            "activation_fn": torch.nn.Tanh,
            "log_std_init": -2.0,
        }
        return SAC(
            "MlpPolicy", env, batch_size=512, gradient_steps=16, buffer_size=300_000, policy_kwargs=kwargs, **common
        )  # fmt: skip
    kwargs = {"net_arch": {"pi": units, "vf": [64, 64]}, "log_std_init": SETTINGS.log_std}
    episode = scheduled(env).station.n_windows
    n_steps = min(episode, max(1, plan.evaluate_every // plan.n_envs))
    common |= {"n_steps": n_steps, "clip_range": 0.2, "target_kl": 0.04, "gae_lambda": SETTINGS.gae_lambda}
    if plan.memory:
        kwargs["lstm_hidden_size"] = plan.memory
        # passes over whole tests, step by step, cost several times those over single windows: fewer and larger ones
        batch = max(64, n_steps * plan.n_envs // 4)
        return RecurrentPPO(
            "MlpLstmPolicy", env, batch_size=batch, n_epochs=4, policy_kwargs=kwargs, **common
        )
    batch = max(64, n_steps * plan.n_envs // 8)
    return PPO("MlpPolicy", env, batch_size=batch, n_epochs=8, policy_kwargs=kwargs, **common)


class _Watch(BaseCallback):
    """Evaluates, saves and tells; stops at the end of the time."""

    def __init__(self, trainer: Trainer, until: float, progress: Callable[[str, float], None] | None) -> None:
        super().__init__()
        self.trainer, self.until, self.progress = trainer, until, progress
        self._next = trainer.plan.evaluate_every + (trainer.curve[-1].steps if trainer.curve else 0)

    def _on_step(self) -> bool:
        return time.monotonic() < self.until or self.trainer.plan.algorithm == "ppo"

    def _on_rollout_end(self) -> None:
        plan, steps = self.trainer.plan, self.num_timesteps
        if steps >= self._next:
            self.trainer.checkpoint(steps)
            self._next = steps + plan.evaluate_every
        if self.progress is not None:
            last = self.trainer.curve[-1]
            self.progress(
                f"{last.merit:.1f} nat, {100 * last.violations:.2f} % violations",
                min(steps / plan.steps, 1.0),
            )

    def _on_rollout_start(self) -> None:
        if time.monotonic() >= self.until:
            raise _Stop


class _Stop(Exception):
    """The time is over."""


class Trainer:
    """A training run in a folder, from where it was stopped.

    Attributes:
        plan: What is trained.
        folder: Checkpoint, curve (`curve.json`) and best policy so far (`best.npz`).
        curve: Evaluations so far, the first before training.
    """

    def __init__(self, plan: TrainingPlan, folder: Path, *, resume: bool = True) -> None:
        """Start or go on.

        Args:
            plan: What to train.
            folder: Where.
            resume: Go on with what is there, if it is of the same plan but for its number of steps.

        Raises:
            FileFormatError: The folder holds another plan's training.
        """
        torch.set_num_threads(
            max(1, len(os.sched_getaffinity(0)) // 2) if hasattr(os, "sched_getaffinity") else 1
        )
        self.plan, self.folder = plan, folder
        self._spent, self._started = 0.0, time.monotonic()
        self.curve: list[Score] = []
        document = folder / "curve.json"
        if resume and document.is_file():
            saved = json.loads(document.read_text(encoding="utf-8"))
            if replace(TrainingPlan(**saved["plan"]), steps=plan.steps) != plan:
                raise FileFormatError(
                    f"{folder} holds the training of another plan ({saved['plan']}); take another folder or start afresh"
                )
            self.curve = [Score(**row) for row in saved["curve"]]
            self._spent = self.curve[-1].seconds
            fresh = _environment(plan, np.load(folder / "schedule.npy"))
            self.env = VecNormalize.load(str(folder / "statistics.pkl"), scheduled(fresh))
            kind = SAC if plan.algorithm == "sac" else RecurrentPPO if plan.memory else PPO
            self.model = kind.load(folder / "model.zip", env=self.env, device="cpu")
            return
        feedback = first_feedback(plan)
        self.env = _environment(plan, feedback.schedule)
        self.model = _model(plan, self.env)
        if plan.start != "nothing":
            imitate(self.model, self.env, feedback, seed=plan.seed)
        content = io.BytesIO()
        np.save(content, feedback.schedule)
        write_bytes(folder / "schedule.npy", content.getvalue())
        self.checkpoint(0)

    @property
    def seconds(self) -> float:
        """Time spent on training so far, evaluations included [s]."""
        return self._spent + time.monotonic() - self._started

    def policy(self) -> Policy:
        """The policy as it is now."""
        identifier, arguments = TASKS[self.plan.task]
        about = {
            "environment": identifier,
            "arguments": arguments,
            "plan": asdict(self.plan),
            "steps": int(self.model.num_timesteps),
            "seconds": round(self.seconds, 1),
        }
        return export(self.model, self.env, name=self.plan.task, about=about)

    def checkpoint(self, steps: int) -> None:
        """Evaluate on held-out rigs and save."""
        policy = self.policy()
        score = evaluate(policy, self.plan.task, n=self.plan.n_held_out, reward=self.plan.scored)
        best = max((row.score for row in self.curve), default=-math.inf)
        self.curve.append(score._replace(steps=steps, seconds=round(self.seconds, 1)))
        document = {"plan": asdict(self.plan), "curve": [row._asdict() for row in self.curve]}
        with together():  # a training that is resumed finds its model, statistics and curve of one moment
            if score.score > best:
                policy.save(self.folder / "best.npz")
            with replacing(self.folder / "model.zip") as temporary:
                self.model.save(temporary)
            with replacing(self.folder / "statistics.pkl") as temporary:
                self.env.save(str(temporary))
            write_text(self.folder / "curve.json", json.dumps(document, indent=1))

    def run(
        self, *, seconds: float = math.inf, progress: Callable[[str, float], None] | None = None
    ) -> Policy:
        """Train to the end of the plan or of the time.

        Args:
            seconds: Most time to spend now.
            progress: Called with a label and the share done.

        Returns:
            The best policy so far, by its score on held-out rigs.
        """
        left = self.plan.steps - self.model.num_timesteps
        if left > 0:
            watch = _Watch(self, time.monotonic() + seconds, progress)
            with contextlib.suppress(_Stop):
                self.model.learn(left, callback=watch, reset_num_timesteps=self.model.num_timesteps == 0)
            if self.model.num_timesteps > self.curve[-1].steps:
                self.checkpoint(int(self.model.num_timesteps))
        return Policy.load(self.folder / "best.npz")
