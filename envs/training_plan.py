"""What is trained, and how: the plan of a training."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from bench.errors import ParameterError, UnknownNameError

from . import IDS

TASKS: dict[str, tuple[str, dict[str, Any]]] = {
    "sdof": (IDS[0], {}),
    "joint": (IDS[1], {}),
    "rivals": (IDS[2], {"rig": "sdof"}),
    "joint_rivals": (IDS[2], {}),
}
"""What can be trained: an environment and its arguments."""

ALGORITHMS = ("ppo", "sac")
TRAINED_BY = ("practice", "error", "prior", "posterior")
STARTS = ("pump", "design", "nothing")


@dataclass(frozen=True)
class TrainingSettings:
    """Numbers of `envs.training_plan`."""

    held_out: int = 1_000_000
    """Seeds from here on are for evaluation only."""
    episodes: int = 3
    noise: float = 0.3
    imitation_rate: float = 2e-3
    imitation_windows: tuple[int, int] = (1500, 512)
    imitation_tests: tuple[int, int] = (300, 48)
    """Steps of imitation, and windows, or with a memory whole tests, in each."""
    log_std: float = -1.2
    """Logarithm of the exploration's standard deviation at the start."""
    gae_lambda: float = 1.0
    """Advantages of PPO are whole returns less the value, never bootstrapped from it: what a test has told about the hidden rig so far
    is not in the observation, so that the value is a poor guess; with 0.95 some seeds score less the longer they are trained."""


SETTINGS = TrainingSettings()


@dataclass(frozen=True)
class TrainingPlan:
    """What to train and how.

    Attributes:
        task: One of `TASKS`.
        algorithm: "ppo" or "sac".
        steps: Windows in all.
        seed: Seed of rigs, noise, network and exploration.
        n_envs: Benches side by side.
        network: Units of the hidden layers.
        memory: Units of a long short-term memory before them, which keeps the record; none by default.
        start: What is imitated before, see `envs.feedback`: "pump", "design", or "nothing".
        reward: "practice" (merit at each rig) or "error" (expected error at each rig, which has a background), see `envs.practice`; or
            the registered environment with the merit's "prior" or "posterior" average.
        learning_rate: Of Adam, at the start; falls linearly.
        discount: Of rewards, a window.
        evaluate_every: Windows between evaluations, each with a checkpoint.
        n_held_out: Rigs of an evaluation.
    """

    task: str = "sdof"
    algorithm: str = "ppo"
    steps: int = 4_000_000
    seed: int = 0
    n_envs: int = 192
    network: tuple[int, ...] = (64, 64)
    memory: int = 0
    start: str = "pump"
    reward: str = "practice"
    learning_rate: float = 4e-4
    discount: float = 0.995
    evaluate_every: int = 100_000
    n_held_out: int = 96

    def __post_init__(self) -> None:
        object.__setattr__(self, "network", tuple(self.network))
        for what, name, known in (
            ("task", self.task, TASKS),
            ("algorithm", self.algorithm, ALGORITHMS),
            ("reward", self.reward, TRAINED_BY),
            ("start", self.start, STARTS),
        ):
            if name not in known:
                raise UnknownNameError(what, name, known)
        if self.reward == "error" and self.task not in ("sdof", "joint"):
            raise ParameterError(
                f"reward \"error\" came with task '{self.task}', in which nothing is identified; sdof or joint is expected"
            )
        if self.memory < 0 or (self.memory and self.algorithm != "ppo"):
            raise ParameterError(
                f"a memory of {self.memory} units came with algorithm '{self.algorithm}'; one of none or more with \"ppo\" is expected"
            )
        if min(self.steps, self.n_envs, self.evaluate_every, self.n_held_out, *self.network) < 1:
            raise ParameterError(f"{self} has a number below one; steps, benches and units are positive")

    @property
    def scored(self) -> str:
        """The reward by which policies are scored on held-out rigs."""
        return "error" if self.reward == "error" else "information"


@dataclass(frozen=True)
class PlanTraining:
    """What to train and how.

    Attributes:
        task: "sdof" or "joint".
        decisions: Times of decisions, as shares of the test.
        plans: Plans that each decision is among.
        rigs: Rigs of each hypothesis on which plans are tried.
        tried: Plans, drawn anew, that are tried on each: of the same number of trials the network learns more from many rigs than from
            many plans on each.
        backgrounds: Share of the rigs that have a background, see `bench.excitation.background`: so many plans are made for the error
            that is left over all backgrounds, and on so many rigs that error is what is to be told from the record.
        evaluations: Signals that the search for the opening weighs.
        generations: Generations of the search for each plan, see `bench.excitation.Planner`.
        steps: Steps of the network's training, for each decision.
        seed: Seed of rigs, searches, noise and network.
    """

    task: str = "sdof"
    decisions: tuple[float, ...] = (0.2, 0.4)
    plans: int = 240
    rigs: int = 5000
    tried: int = 40
    backgrounds: float = 0.0
    evaluations: int = 1600
    generations: int = 16
    steps: int = 6000
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "decisions", tuple(self.decisions))
        if self.task not in ("sdof", "joint"):
            raise ParameterError(
                f"plans came with task '{self.task}', in which nothing is identified; sdof or joint is expected"
            )
        ordered = (0.0, *self.decisions, 1.0)
        if any(a >= b for a, b in pairwise(ordered)):
            raise ParameterError(
                f"decisions at {self.decisions} came; ascending shares of the test between 0 and 1 are expected"
            )
        if not 0.0 <= self.backgrounds <= 1.0:
            raise ParameterError(
                f"a share of {self.backgrounds:g} of the rigs came to have a background; 0 to 1 is expected"
            )
        if min(self.plans, self.rigs, self.tried, self.evaluations, self.generations, self.steps) < 1:
            raise ParameterError(f"{self} has a number below one; plans, rigs and steps are positive")
