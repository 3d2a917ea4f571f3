"""A trained policy as plain arrays, which run without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from bench.excitation.policy import Policy

from .scheduled import scheduled


def export(model: PPO | SAC, normaliser: VecNormalize, *, name: str, about: dict[str, Any]) -> Policy:
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
    )


def layers(model: PPO | SAC) -> list[torch.nn.Module]:
    """The modules that the mean of the actions passes, in order."""
    if isinstance(model, SAC):
        return [*model.actor.latent_pi, model.actor.mu]
    return [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
