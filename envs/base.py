"""What the single and the vector environments share: spaces, arguments and the benches behind them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from bench.errors import ParameterError

from .benches import Benches
from .options import Options, require_count
from .practice import PracticeBenches
from .setups import PAIRS, SDOF_LAWS, Setup, discrimination_setup, joint_setup, sdof_setup
from .stepped import FLOATS, SteppedBenches


@dataclass(frozen=True)
class EnvSettings:
    """Numbers of `envs.base`."""

    most_draws: int = 10_000
    """Most prior draws that a reward is averaged over: its standard error is then a hundredth of their spread, and every step runs
    each."""


SETTINGS = EnvSettings()

RENDER_MODES = ("rgb_array", "human")

_OPTIONS = tuple(Options.__dataclass_fields__)


def setup_of(kind: str, arguments: dict[str, Any]) -> Setup:
    """The setup of an environment from its arguments; takes those that concern it out of `arguments`.

    Args:
        kind: "sdof", "joint" or "discrimination".
        arguments: Keyword arguments of the environment.

    Raises:
        BenchError: One of them has a value outside its range.
    """
    if kind == "sdof":
        laws = _names("laws", arguments.pop("laws", SDOF_LAWS))
        return sdof_setup(
            laws, require_count("n_draws", arguments.pop("n_draws", 2 * len(laws)), SETTINGS.most_draws)
        )
    n_draws = require_count("n_draws", arguments.pop("n_draws", 4), SETTINGS.most_draws)
    if kind == "joint":
        return joint_setup(n_draws)
    rig = arguments.pop("rig", "joint")
    pairs = _names("pairs", arguments.pop("pairs", PAIRS if rig == "joint" else PAIRS[:-1]))
    return discrimination_setup(rig, pairs, n_draws)


def _names(argument: str, given: Any) -> tuple[str, ...]:
    """An argument that lists names.

    Raises:
        ParameterError: It is no list of strings, or an empty one.
    """
    names = tuple(given) if isinstance(given, tuple | list) else ()
    if not names or not all(isinstance(name, str) for name in names):
        raise ParameterError(f"{argument} is {given!r}; a list of at least one name is expected")
    return names


def make_benches(kind: str, n: int, threads: int, arguments: dict[str, Any]) -> Benches | PracticeBenches:
    """Benches for an environment with given arguments; practice benches where the reward looks at each rig itself.

    Raises:
        TypeError: An argument is unknown.
        BenchError: An argument has a value outside its range.
    """
    rest = dict(arguments)
    setup = setup_of(kind, rest)
    options = options_of(rest)
    if options.reward == "error":
        return PracticeBenches(setup, options, n, drawn=True)
    return Benches(setup, options, n, threads)


def options_of(arguments: dict[str, Any]) -> Options:
    """Options from what `setup_of` left of an environment's arguments.

    Raises:
        TypeError: An argument is unknown.
        BenchError: An argument has a value outside its range.
    """
    unknown = sorted(set(arguments) - set(_OPTIONS))
    if unknown:
        raise TypeError(
            f"unknown argument(s) {unknown} of a JointBench environment; known: {', '.join(_OPTIONS)}"
        )
    return Options(**arguments)


def observation_space(benches: SteppedBenches) -> spaces.Box:
    """Box of a bench's observations."""
    return spaces.Box(-1.0, 1.0, (benches.n_observations,), np.float32)


def action_space(benches: SteppedBenches) -> spaces.Box:
    """Box of a bench's actions."""
    return spaces.Box(-1.0, 1.0, (benches.width,), np.float32)


def info_of(info: dict[str, Any], row: int) -> dict[str, float | bool]:
    """One bench's `info`, in Python floats and bools."""
    entries: dict[str, float | bool] = {name: float(info[name][row]) for name in FLOATS}
    entries["violation"] = bool(info["violation"][row])
    return entries


def rest_info(benches: SteppedBenches, places: np.ndarray) -> dict[str, np.ndarray]:
    """`info` of benches that were just reset."""
    info = {name: np.zeros(len(places)) for name in FLOATS}
    info["effective_draws"] = benches.effective_draws(places)
    info["violation"] = np.zeros(len(places), dtype=bool)
    return info
