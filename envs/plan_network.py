"""The network of a decision between plans: told what plans leave to know of rigs, it learns to tell that from their noisy records.

Importing this module imports torch (extra `rl`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bench.errors import ParameterError
from bench.excitation import PlanStage, Station
from bench.excitation.plan_policy import n_entries

from .training_plan import PlanTraining


@dataclass(frozen=True)
class PlanNetworkSettings:
    """Numbers of `envs.plan_network`."""

    units: tuple[int, ...] = (192, 96)
    batch: int = 256
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    aside: float = 0.1
    """Part of the rigs that the network does not learn from: the state of least loss on them is kept."""
    checks: int = 40
    """Times at which it is looked at."""


SETTINGS = PlanNetworkSettings()


class TriedPlans(NamedTuple):
    """What was tried at a decision: n rigs."""

    plans: NDArray[np.float32]  # (n_plans, n_windows - window, width)
    record: NDArray[np.float32]  # (n, window, n_entries) without noise
    values: NDArray[np.float32]  # (n, 1 + n_plans), NaN where a plan was not tried on a rig


def learned(
    training: PlanTraining, station: Station, window: int, table: TriedPlans, told: Callable[[float], None]
) -> PlanStage:
    """The decision after some windows: a network that tells the values of a table from its records with noise on them."""
    n = len(table.values)
    rng = np.random.default_rng((training.seed, window))
    torch.manual_seed(training.seed)
    order = rng.permutation(n)
    count = max(1, round(SETTINGS.aside * n))
    aside, own = order[:count], order[count:]
    noise = np.zeros(n_entries(station), dtype=np.float32)
    shares = [station.noise[name] / station.scale[name] for name in station.channels]
    noise[: station.n_steps * len(station.channels)] = np.tile(shares, station.n_steps)
    mean = table.record[own].mean(axis=0)
    # commands that are the same in every record say nothing
    deviation = np.sqrt(table.record[own].var(axis=0) + noise**2 + 1e-6)
    if unknown := int(np.sum(np.isnan(table.values[own]).all(axis=0))):
        raise ParameterError(
            f"{unknown} of {len(table.plans)} plans were tried on no rig that the network learns from ({len(own)} rigs, "
            f"{training.tried} plans on each); more rigs, more plans on each, or fewer plans are expected"
        )
    offset, spread = np.nanmean(table.values[own], axis=0), max(float(np.nanstd(table.values[own])), 1e-6)
    network = _network(len(mean.ravel()), table.values.shape[1])
    optimiser = torch.optim.AdamW(
        network.parameters(), SETTINGS.learning_rate, weight_decay=SETTINGS.weight_decay
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, SETTINGS.learning_rate, total_steps=training.steps
    )

    def pair(rows: NDArray[np.int64]) -> tuple[Tensor, Tensor]:
        shown = table.record[rows]
        shown = shown + noise * rng.standard_normal(shown.shape, dtype=np.float32)
        entries = ((shown - mean) / deviation).reshape(len(rows), -1)
        return torch.as_tensor(entries), torch.as_tensor((table.values[rows] - offset) / spread)

    judged, best, least = pair(aside), network.state_dict(), np.inf
    every = max(1, training.steps // SETTINGS.checks)
    for step in range(training.steps):
        entries, values = pair(own[rng.integers(len(own), size=SETTINGS.batch)])
        loss = _misfit(network(entries), values)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        if step % every == every - 1:
            with torch.no_grad():
                now = float(_misfit(network(judged[0]), judged[1]))
            if now < least:
                least, best = now, {name: value.clone() for name, value in network.state_dict().items()}
            told((step + 1) / training.steps)
    network.load_state_dict(best)
    layers = [module for module in network if isinstance(module, torch.nn.Linear)]
    weights = [layer.weight.detach().numpy() for layer in layers]
    biases = [layer.bias.detach().numpy() for layer in layers]
    weights[-1], biases[-1] = weights[-1] * spread, biases[-1] * spread + offset
    return PlanStage(window, table.plans, mean.ravel(), deviation.ravel(), tuple(weights), tuple(biases))


def _misfit(told: Tensor, values: Tensor) -> Tensor:
    """Mean square over what was tried."""
    tried = ~torch.isnan(values)
    return torch.mean((told[tried] - values[tried]) ** 2)


def _network(width: int, choices: int) -> torch.nn.Sequential:
    modules: list[torch.nn.Module] = []
    for units in SETTINGS.units:
        modules += [torch.nn.Linear(width, units), torch.nn.Tanh()]
        width = units
    return torch.nn.Sequential(*modules, torch.nn.Linear(width, choices))
