"""Trained policies: small networks as plain arrays that shape an excitation window by window, without torch.

A policy is an answer to the environments of `envs`, trained by `scripts/train_excitation.py`. It carries the station it was
trained for (channels, scales, limits, windows), because its numbers mean something there only.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, ParameterError, UnknownNameError
from bench.excitation.station import Station
from bench.files import write_bytes

FOLDER = Path(__file__).resolve().parent.parent / "_data" / "policies"
FORMAT = 1
CLIP = 10.0
"""Normalised observations are cut off there, as stable-baselines3's `VecNormalize` does."""


@dataclass(frozen=True, eq=False)
class Policy:
    """A network with hyperbolic tangents between its layers: observations in, the mean of the actions out.

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

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):
            object.__setattr__(self, name, tuple(_frozen(array) for array in getattr(self, name)))
        for name in ("mean", "deviation", "schedule"):
            object.__setattr__(self, name, _frozen(getattr(self, name)))
        object.__setattr__(self, "about", MappingProxyType(dict(self.about)))
        width = len(self.mean)
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

    def __reduce__(self) -> tuple:
        rest = (self.schedule, self.station, self.bounded, dict(self.about))
        return (Policy, (self.name, self.weights, self.biases, self.mean, self.deviation, *rest))

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions ``(…, n_actions)`` in −1 … 1 for observations ``(…, n_observations)``.

        Raises:
            ParameterError: The observations have another length.
        """
        observation = np.asarray(observation, dtype=np.float32)
        if observation.shape[-1:] != self.mean.shape:
            raise ParameterError(
                f"policy '{self.name}' was trained on observations of length {len(self.mean)}; {observation.shape} came"
            )
        value = np.clip((observation - self.mean) / self.deviation, -CLIP, CLIP)
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
        content = io.BytesIO()
        np.savez_compressed(content, allow_pickle=False, document=np.array(json.dumps(about)), **arrays)
        write_bytes(path if path.suffix == ".npz" else Path(f"{path}.npz"), content.getvalue())

    @classmethod
    def load(cls, path: Path) -> Policy:
        """Read what `save` wrote.

        Raises:
            FileFormatError: The file is no policy, or of another format.
        """
        try:
            with np.load(path, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
            document = json.loads(str(arrays["document"]))
        except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise FileFormatError(
                f"{path} is no policy ({error}); one is written by scripts/train_excitation.py"
            ) from error
        if document.get("format") != FORMAT:
            raise FileFormatError(
                f"{path} has the policy format {document.get('format')}; this version reads format {FORMAT}"
            )
        count = sum(name.startswith("weight_") for name in arrays)
        return cls(
            document["name"],
            tuple(arrays[f"weight_{i}"] for i in range(count)),
            tuple(arrays[f"bias_{i}"] for i in range(count)),
            arrays["mean"],
            arrays["deviation"],
            arrays["schedule"],
            Station.from_dict(document["station"]),
            document["bounded"],
            document["about"],
        )


def _frozen(array: NDArray) -> NDArray[np.float32]:
    result = np.array(array, dtype=np.float32)
    result.flags.writeable = False
    return result


def policy_names() -> tuple[str, ...]:
    """Names of the policies that come with the package."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.npz")))


def find_policy(name: str) -> Policy:
    """A policy by its name, or by the path of its file.

    Raises:
        UnknownNameError: Neither.
        FileFormatError: The file is no policy.
    """
    if name in policy_names():
        return Policy.load(FOLDER / f"{name}.npz")
    path = Path(name)
    if path.suffix == ".npz" and path.is_file():
        return Policy.load(path)
    raise UnknownNameError("policy (or file of one, .npz)", name, policy_names())
