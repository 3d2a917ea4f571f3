"""A start for training: the policy imitates a hand-made feedback under schedules of designed force."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecNormalize
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from .base import setup_of
from .feedback import Feedback, braked_design, pump
from .policy_export import Learner, layers
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


def imitate(model: Learner, env: VecNormalize, feedback: Feedback, *, seed: int) -> None:
    """Fit a model's mean action to a feedback's corrections, and the statistics of the observations to what it meets.

    Args:
        model: The model.
        env: Its environment.
        feedback: What is imitated; its schedule is the environment's.
        seed: Seed of the tests.
    """
    venv, rng = scheduled(env), np.random.default_rng(seed)
    seen, told, begun = [], [], []
    observation, start = venv.reset(), np.ones(venv.num_envs, dtype=bool)
    for _ in range(SETTINGS.episodes * feedback.station.n_windows):
        wanted = feedback.correction(observation)
        seen.append(observation)
        told.append(wanted)
        begun.append(start)
        observation, _, start, _ = venv.step(wanted + SETTINGS.noise * rng.standard_normal(wanted.shape))
        observation = np.asarray(observation)
    x, y = np.stack(seen), np.stack(told)
    env.obs_rms.update(x.reshape(-1, x.shape[-1]))  # type: ignore[union-attr]
    y = np.arctanh(np.clip(y, -0.96, 0.96)) if isinstance(model, SAC) else y
    inputs = torch.as_tensor(np.asarray(env.normalize_obs(x)), dtype=torch.float32)
    target = torch.as_tensor(y, dtype=torch.float32)
    if isinstance(model, RecurrentPPO):
        _imitate_tests(model, _tests(inputs, target, np.stack(begun)), rng)
    else:
        _imitate_windows(model, inputs.flatten(0, 1), target.flatten(0, 1), rng)


def _imitate_windows(model: Learner, inputs: Tensor, target: Tensor, rng: np.random.Generator) -> None:
    network = torch.nn.Sequential(*layers(model))
    optimiser = torch.optim.Adam(network.parameters(), lr=SETTINGS.imitation_rate)
    steps, batch = SETTINGS.imitation_windows
    for _ in range(steps):
        rows = torch.as_tensor(rng.integers(len(inputs), size=batch))
        loss = torch.nn.functional.mse_loss(network(inputs[rows]), target[rows])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()


def _tests(inputs: Tensor, target: Tensor, begun: NDArray[np.bool_]) -> list[tuple[Tensor, Tensor]]:
    """What was seen and told in each test ``(n_windows, …)``; a limit switch ends some early."""
    tests = []
    for place in range(begun.shape[1]):
        edges = [*np.flatnonzero(begun[:, place]).tolist(), len(begun)]
        tests += [(inputs[a:b, place], target[a:b, place]) for a, b in pairwise(edges)]
    return tests


def _imitate_tests(model: RecurrentPPO, tests: list[tuple[Tensor, Tensor]], rng: np.random.Generator) -> None:
    """The same through the memory, over whole tests."""
    memory, network = model.policy.lstm_actor, torch.nn.Sequential(*layers(model))
    assert isinstance(memory, torch.nn.LSTM)
    optimiser = torch.optim.Adam([*memory.parameters(), *network.parameters()], lr=SETTINGS.imitation_rate)
    steps, batch = SETTINGS.imitation_tests
    for _ in range(steps):
        rows = rng.integers(len(tests), size=batch)
        x, y = (pad_sequence([tests[i][side] for i in rows]) for side in (0, 1))
        lengths = torch.as_tensor([len(tests[i][0]) for i in rows])
        counts = torch.arange(len(x))[:, None] < lengths
        loss = torch.nn.functional.mse_loss(network(memory(x)[0])[counts], y[counts])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
