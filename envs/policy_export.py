"""A trained policy as plain arrays, which run without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from bench.excitation.policy import Policy, Recurrence

from .scheduled import scheduled

Learner = PPO | SAC | RecurrentPPO
"""What is trained."""


def export(model: Learner, normaliser: VecNormalize, *, name: str, about: dict[str, Any]) -> Policy:
    """The mean of a model's actions as a `Policy` of plain arrays.

    Args:
        model: The model.
        normaliser: The statistics of its observations, over the benches with their schedule.
        name: Name of the policy.
        about: Where it comes from.
    """
    linear = [module for module in layers(model) if isinstance(module, torch.nn.Linear)]
    statistics = normaliser.obs_rms
    return Policy(
        name,
        tuple(layer.weight.detach().cpu().numpy() for layer in linear),
        tuple(layer.bias.detach().cpu().numpy() for layer in linear),
        statistics.mean,  # type: ignore[union-attr]
        np.sqrt(statistics.var + normaliser.epsilon),  # type: ignore[union-attr]
        scheduled(normaliser).schedule,
        scheduled(normaliser).station,
        isinstance(model, SAC),
        about,
        _recurrence(model) if isinstance(model, RecurrentPPO) else None,
    )


def _recurrence(model: RecurrentPPO) -> Recurrence:
    cell = {name: value.detach().cpu().numpy() for name, value in model.policy.lstm_actor.named_parameters()}
    return Recurrence(
        cell["weight_ih_l0"], cell["weight_hh_l0"], cell["bias_ih_l0"] + cell["bias_hh_l0"]
    )  # torch has the gates in the order of `Recurrence`


def layers(model: Learner) -> list[torch.nn.Module]:
    """The modules that the mean of the actions passes, in order, behind its memory where it has one."""
    if isinstance(model, SAC):
        return [*model.actor.latent_pi, model.actor.mu]
    return [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
