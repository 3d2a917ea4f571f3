"""Trained policies: small networks as plain arrays that shape an excitation window by window, without torch.

A policy is an answer to the environments of `envs`, trained by `scripts/train_excitation.py`. It carries the station it was
trained for (channels, scales, limits, windows), because its numbers mean something there only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, ParameterError, UnknownNameError, shortened
from bench.excitation.archive import FORMAT, read_archive, write_archive
from bench.excitation.plan_policy import PlanPolicy, plan_policy
from bench.excitation.recurrence import PolicyMemory, Recurrence, frozen
from bench.excitation.station import Station

FOLDER = Path(__file__).resolve().parent.parent / "_data" / "policies"
_RECURRENT = ("input", "hidden", "bias")


@dataclass(frozen=True)
class PolicySettings:
    """Numbers of `bench.excitation.policy`."""

    clip: float = 10.0
    """Normalised observations are cut off there, as stable-baselines3's `VecNormalize` does."""


SETTINGS = PolicySettings()


@dataclass(frozen=True, eq=False)
class Policy:
    """A network with hyperbolic tangents between its layers: observations in, the mean of the actions out.

    With a memory, the layers read what it shows instead of the observations.

    Attributes:
        name: Name.
        weights: Matrices of the layers ``(n_out, n_in)``, float32.
        biases: Their offsets ``(n_out,)``.
        mean: Mean of the observations ``(n_observations,)``.
        deviation: Their standard deviations ``(n_observations,)``.
        schedule: Actions ``(n_questions, n_windows, n_actions)`` that the network's are added to: an open-loop excitation, which
            the network corrects.
        station: What it was trained for.
        bounded: Whether a last hyperbolic tangent bounds the actions (SAC) or they are cut off at −1 and 1 (PPO).
        about: Where it comes from, in JSON values.
        recurrence: Its memory of the record; none where it decides by the last window alone.
    """

    name: str
    weights: tuple[NDArray[np.float32], ...] = field(repr=False)
    biases: tuple[NDArray[np.float32], ...] = field(repr=False)
    mean: NDArray[np.float32] = field(repr=False)
    deviation: NDArray[np.float32] = field(repr=False)
    schedule: NDArray[np.float32] = field(repr=False)
    station: Station = field(repr=False)
    bounded: bool = False
    about: Mapping[str, Any] = field(default_factory=dict)
    recurrence: Recurrence | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):
            object.__setattr__(self, name, tuple(frozen(array) for array in getattr(self, name)))
        for name in ("mean", "deviation", "schedule"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "about", MappingProxyType(dict(self.about)))
        self._check_numbers()
        width = len(self.mean)
        if self.recurrence is not None:
            if self.recurrence.input.shape[1] != width:
                raise ParameterError(
                    f"the memory of policy '{self.name}' takes {self.recurrence.input.shape[1]} observations; {width} are expected"
                )
            width = self.recurrence.n_units
        for weight, bias in zip(self.weights, self.biases, strict=True):
            if weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1]:
                raise ParameterError(
                    f"a layer of policy '{self.name}' has weights {weight.shape} and biases {bias.shape}; "
                    f"(n, {width}) and (n,) are expected"
                )
            width = len(bias)
        windows = (max(1, len(self.station.questions)), self.station.n_windows, width)
        if self.schedule.shape != windows:
            raise ParameterError(
                f"policy '{self.name}' has a schedule of shape {self.schedule.shape}; {windows} is expected"
            )
        if self.deviation.shape != self.mean.shape or not (self.deviation > 0.0).all():
            raise ParameterError(
                f"policy '{self.name}' needs a positive deviation for each of its {len(self.mean)} observations"
            )

    def _check_numbers(self) -> None:
        """Raise `ParameterError` unless all numbers, and what the layers make of any observation, are finite."""
        named = {
            **{f"the weights of layer {i}": array for i, array in enumerate(self.weights)},
            **{f"the biases of layer {i}": array for i, array in enumerate(self.biases)},
            "the mean": self.mean,
            "the deviation": self.deviation,
            "the schedule": self.schedule,
        }
        if self.recurrence is not None:
            memory = self.recurrence
            named["the memory"] = np.concatenate([memory.input, memory.hidden, memory.bias[:, None]], axis=1)
        if len(self.weights) != len(self.biases) or self.mean.ndim != 1:
            raise ParameterError(
                f"policy '{self.name}' has {len(self.weights)} weights, {len(self.biases)} biases and a mean of shape "
                f"{self.mean.shape}; one bias a weight, and one number an observation, are expected"
            )
        for name, array in named.items():
            # observations are cut off at CLIP, hidden values at 1
            sums = np.sum(np.abs(array, dtype=np.float64), axis=-1) * SETTINGS.clip if array.ndim else array
            if not np.all(np.asarray(sums) <= np.finfo(np.float32).max):
                raise ParameterError(
                    f"{name} of policy '{self.name}' hold NaN, infinity or numbers too large; finite numbers are expected"
                )
        if len(self.mean) != self.station.n_observations:
            raise ParameterError(
                f"policy '{self.name}' takes {len(self.mean)} observations; its station gives {self.station.n_observations}"
            )

    def __reduce__(self) -> tuple:
        rest = (self.schedule, self.station, self.bounded, dict(self.about), self.recurrence)
        return (Policy, (self.name, self.weights, self.biases, self.mean, self.deviation, *rest))

    def memory(self, shape: int | tuple[int, ...] = ()) -> PolicyMemory:
        """What is remembered at the start of as many tests: nothing.

        Args:
            shape: Number of tests m, or the shape of what stands before the last axis of the observations; () for one test.
        """
        before = (shape,) if isinstance(shape, int) else shape
        width = self.recurrence.n_units if self.recurrence is not None else 0
        empty = np.zeros((*before, width), dtype=np.float32)
        return PolicyMemory(empty, empty.copy())

    def act(self, observation: NDArray[np.float32], memory: Any = None) -> NDArray[np.float32]:
        """Actions ``(…, n_actions)`` in −1 … 1 for observations ``(…, n_observations)``.

        Args:
            observation: What was seen of the last window.
            memory: The `PolicyMemory` that `memory` gave at the start of the test; brought up to date here, and needed where the
                policy has a memory.

        Raises:
            ParameterError: The observations have another length, or the policy has a memory and none came.
        """
        observation = np.asarray(observation, dtype=np.float32)
        if observation.shape[-1:] != self.mean.shape:
            raise ParameterError(
                f"policy '{self.name}' was trained on observations of length {len(self.mean)}; {observation.shape} came"
            )
        value = np.clip((observation - self.mean) / self.deviation, -SETTINGS.clip, SETTINGS.clip)
        if self.recurrence is not None:
            if memory is None or memory.hidden.shape != (*observation.shape[:-1], self.recurrence.n_units):
                came = "none" if memory is None else f"one of {memory.hidden.shape}"
                raise ParameterError(
                    f"policy '{self.name}' remembers the record, and {came} came as its memory; take "
                    f"memory = policy.memory({observation.shape[:-1]}) at the start of a test and act(observation, memory) in it"
                )
            value = self.recurrence(value, memory)
        last = len(self.weights) - 1
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            value = value @ weight.T + bias
            if i < last or self.bounded:
                value = np.tanh(value)
        return np.clip(value + self.station.scheduled(observation, self.schedule), -1.0, 1.0)

    def save(self, path: Path) -> None:
        """Write the policy as a NumPy archive of plain arrays and a JSON text, whole or not at all.

        Args:
            path: Path of the file; ".npz" is appended where it does not end so.

        Raises:
            OutputError: It cannot be written.
        """
        about = {
            "format": FORMAT,
            "name": self.name,
            "station": self.station.to_dict(),
            "bounded": self.bounded,
            "about": dict(self.about),
        }
        layers = {f"weight_{i}": array for i, array in enumerate(self.weights)}
        layers |= {f"bias_{i}": array for i, array in enumerate(self.biases)}
        arrays = {"mean": self.mean, "deviation": self.deviation, "schedule": self.schedule, **layers}
        if self.recurrence is not None:
            arrays |= {f"memory_{name}": getattr(self.recurrence, name) for name in _RECURRENT}
        write_archive(path, "document", about, arrays)

    @classmethod
    def load(cls, path: Path) -> Policy:
        """Read what `save` wrote.

        Raises:
            FileFormatError: The file is no policy, or of another format.
        """
        arrays, text = read_archive(path, "document")
        return _policy(path, arrays, text)


def _policy(path: Path, arrays: dict[str, NDArray[Any]], text: str) -> Policy:
    from bench.documents import DocumentLimits, checked, naming, parse_json  # noqa: PLC0415
    from bench.excitation.schema import PolicyHeader  # noqa: PLC0415

    # infinity stands for no limit there
    document = parse_json(text, str(path), limits=DocumentLimits(finite=False))
    header = checked(PolicyHeader, document, str(path))
    count = sum(name.startswith("weight_") for name in arrays)
    layers = [f"{kind}_{i}" for kind in ("weight", "bias") for i in range(count)]
    remembered = [f"memory_{name}" for name in _RECURRENT]
    recurrent = any(name in arrays for name in remembered)
    expected = {*layers, "mean", "deviation", "schedule", *(remembered if recurrent else ())}
    if not count or set(arrays) != expected:
        odd = sorted(set(arrays) ^ expected)
        raise FileFormatError(
            f"{path} is no policy: of its arrays, {', '.join(map(shortened, odd[:5]))} {'is' if len(odd) == 1 else 'are'} "
            "missing or too many; mean, deviation, schedule and a weight and a bias for each layer are expected"
        )
    with naming(str(path)):
        return Policy(
            header.name,
            tuple(arrays[name] for name in layers[:count]),
            tuple(arrays[name] for name in layers[count:]),
            arrays["mean"],
            arrays["deviation"],
            arrays["schedule"],
            Station.from_entry(header.station),
            header.bounded,
            header.about,
            Recurrence(*(arrays[name] for name in remembered)) if recurrent else None,
        )


def policy_names() -> tuple[str, ...]:
    """Names of the policies that come with the package."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.npz")))


def find_policy(name: str) -> Policy | PlanPolicy:
    """A policy by its name, or by the path of its file.

    Raises:
        UnknownNameError: Neither.
        FileFormatError: The file is no policy.
    """
    path = FOLDER / f"{name}.npz" if name in policy_names() else Path(name)
    if path.suffix == ".npz" and path.is_file():
        arrays, text = read_archive(path, "plan_document", "document")
        return plan_policy(path, arrays, text) if "opening" in arrays else _policy(path, arrays, text)
    raise UnknownNameError("policy (or file of one, .npz)", name, policy_names())
