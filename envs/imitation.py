"""A start for training: the policy imitates a hand-made feedback under schedules of designed force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from .base import setup_of
from .feedback import Feedback, braked_design, pump
from .policy_export import layers
from .sb3 import KINDS
from .scheduled import scheduled
from .training_plan import SETTINGS, TASKS, TrainingPlan


def first_feedback(plan: TrainingPlan) -> Feedback:
    """What training starts from."""
    identifier, arguments = TASKS[plan.task]
    setup = setup_of(KINDS[identifier], dict(arguments))
    if plan.start == "design":
        return braked_design(setup, np.random.default_rng(plan.seed))
    start = pump(setup.station())
    return start if plan.start == "pump" else replace(start, schedule=np.zeros_like(start.schedule))


def imitate(model: PPO | SAC, env: VecNormalize, feedback: Feedback, *, seed: int) -> None:
    """Fit a model's mean action to a feedback's corrections, and the statistics of the observations to what it meets.

    Args:
        model: The model.
        env: Its environment.
        feedback: What is imitated; its schedule is the environment's.
        seed: Seed of the tests.
    """
    venv, rng = scheduled(env), np.random.default_rng(seed)
    seen, told = [], []
    observation = venv.reset()
    for _ in range(SETTINGS.episodes * feedback.station.n_windows):
        wanted = feedback.correction(observation)
        seen.append(observation)
        told.append(wanted)
        observation = np.asarray(venv.step(wanted + SETTINGS.noise * rng.standard_normal(wanted.shape))[0])
    x, y = np.concatenate(seen), np.concatenate(told)
    env.obs_rms.update(x)  # type: ignore[union-attr]
    y = np.arctanh(np.clip(y, -0.96, 0.96)) if isinstance(model, SAC) else y
    target = torch.as_tensor(y, dtype=torch.float32)
    inputs = torch.as_tensor(np.asarray(env.normalize_obs(x)), dtype=torch.float32)
    network = torch.nn.Sequential(*layers(model))
    optimiser = torch.optim.Adam(network.parameters(), lr=2e-3)
    for _ in range(1500):
        rows = torch.as_tensor(rng.integers(len(x), size=512))
        loss = torch.nn.functional.mse_loss(network(inputs[rows]), target[rows])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
