"""Policies that choose among plans: excitations made for drawn rigs, one of which is taken once the record tells which rig is there.

A planner identifies the rig from the record so far and then searches for the best rest of the test; it takes a fraction of a second each
time. Here both are done beforehand. For many rigs drawn from the prior the best rest was searched for; for many more, what each of these
plans would leave to know of the rig was computed; and a network learned to tell that from the noisy record so far. In the laboratory
it reads the whole record at a few times and the plan of least expected error is taken: microseconds, by NumPy alone.

References:
    Foster, Ivanova, Malik, Rainforth 2021, "Deep adaptive design: amortizing sequential Bayesian experimental design", ICML (a
    network in the place of identification and search); Raiffa, Schlaifer 1961, "Applied Statistical Decision Theory" (the decision of
    least expected loss).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.acting import check_window, rows_of
from bench.excitation.archive import FORMAT, write_archive
from bench.excitation.recurrence import frozen
from bench.excitation.station import Station


@dataclass(frozen=True)
class PlanPolicySettings:
    """Numbers of `bench.excitation.plan_policy`."""

    clip: float = 10.0
    """Standardised entries of the record are cut off there, as those of other policies."""


SETTINGS = PlanPolicySettings()


@dataclass(frozen=True, eq=False)
class PlanStage:
    """A time of decision: the plans that may be taken from there on, and the network that weighs them.

    Attributes:
        window: Windows run before it.
        plans: Actions of the windows from there to the end ``(n_plans, n_windows - window, width)``. To go on as before is a further
            choice, the first.
        mean: Mean of the record's entries ``(window * n_entries,)``, see `entries`.
        deviation: Their standard deviations.
        weights: Matrices of the network's layers ``(n_out, n_in)``, hyperbolic tangents between them. Out comes the expected value of
            each choice ``(1 + n_plans,)``: the logarithm of the error that is left at the end, and 0, as much as nothing known, where
            a limit would be passed.
        biases: Their offsets ``(n_out,)``.
    """

    window: int
    plans: NDArray[np.float32] = field(repr=False)
    mean: NDArray[np.float32] = field(repr=False)
    deviation: NDArray[np.float32] = field(repr=False)
    weights: tuple[NDArray[np.float32], ...] = field(repr=False)
    biases: tuple[NDArray[np.float32], ...] = field(repr=False)

    def __post_init__(self) -> None:
        for name in ("plans", "mean", "deviation"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("weights", "biases"):
            object.__setattr__(self, name, tuple(frozen(array) for array in getattr(self, name)))
        dimensions = {"plans": self.plans.ndim - 2, "mean": self.mean.ndim, "deviation": self.deviation.ndim}
        dimensions |= {f"biases {i}": array.ndim for i, array in enumerate(self.biases)}
        dimensions |= {f"weights {i}": array.ndim - 1 for i, array in enumerate(self.weights)}
        odd = [name for name, excess in dimensions.items() if excess != 1]
        if odd or len(self.weights) != len(self.biases) or not self.weights:
            raise ParameterError(
                f"the decision after {self.window} windows has {len(self.weights)} weights, {len(self.biases)} biases and "
                f"{', '.join(odd) or 'no array'} of another number of dimensions; a bias a weight, plans (n, n_windows, width), matrices "
                "of weights and one dimension elsewhere are expected"
            )
        arrays = (self.plans, self.mean, self.deviation, *self.weights, *self.biases)
        sums = [np.sum(np.abs(array, dtype=np.float64), axis=-1).max(initial=0.0) for array in arrays]
        if not np.max(sums) * SETTINGS.clip <= np.finfo(np.float32).max or not (self.deviation > 0.0).all():
            raise ParameterError(
                f"the decision after {self.window} windows holds NaN, infinity, numbers too large or a deviation that is not positive; "
                "finite numbers are expected"
            )
        width = [len(self.mean), *(len(bias) for bias in self.biases)]
        shapes = [(b, a) for a, b in pairwise(width)]
        if (
            self.deviation.shape != self.mean.shape
            or [weight.shape for weight in self.weights] != shapes
            or width[-1] != 1 + len(self.plans)
        ):
            raise ParameterError(
                f"the decision after {self.window} windows has layers {[weight.shape for weight in self.weights]} for "
                f"{len(self.mean)} entries of the record and {len(self.plans)} plans; {shapes} with {1 + len(self.plans)} outputs "
                "are expected"
            )

    def values(self, record: NDArray[np.float32]) -> NDArray[np.float32]:
        """Expected value of each choice ``(m, 1 + n_plans)``, the less the better, for records ``(m, window * n_entries)``."""
        value = np.clip((record - self.mean) / self.deviation, -SETTINGS.clip, SETTINGS.clip)
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            value = (np.tanh(value) if i else value) @ weight.T + bias
        return np.asarray(value, dtype=np.float32)


@dataclass(eq=False)
class PlanMemory:
    """What a policy of plans remembers of m tests.

    Attributes:
        seen: Windows seen.
        record: Entries of the record so far ``(m, n_windows, n_entries)``.
        actions: What is done in each window ``(m, n_windows, width)``.
    """

    seen: int
    record: NDArray[np.float32]
    actions: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class PlanPolicy:
    """An opening, and decisions among plans. In the place of a `Policy` wherever one acts.

    Attributes:
        name: Name.
        station: What it was trained for; its actions are knots.
        opening: Actions of each window ``(n_windows, width)`` until the first decision takes another plan.
        stages: The decisions, ascending in time.
        about: Where it comes from, in JSON values.
    """

    name: str
    station: Station = field(repr=False)
    opening: NDArray[np.float32] = field(repr=False)
    stages: tuple[PlanStage, ...] = field(repr=False)
    about: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "opening", frozen(self.opening))
        object.__setattr__(self, "stages", tuple(self.stages))
        object.__setattr__(self, "about", MappingProxyType(dict(self.about)))
        station = self.station
        shape = (station.n_windows, station.width)
        if self.opening.shape != shape or not np.isfinite(self.opening).all():
            raise ParameterError(
                f"policy '{self.name}' has an opening of shape {self.opening.shape}; finite {shape} is expected"
            )
        for before, stage in pairwise((None, *self.stages)):
            assert stage is not None
            rest = (len(stage.plans), station.n_windows - stage.window, station.width)
            entries = stage.window * n_entries(station)
            first = 1 if before is None else before.window + 1
            if (
                not first <= stage.window < station.n_windows
                or stage.plans.shape != rest
                or len(stage.mean) != entries
            ):
                raise ParameterError(
                    f"policy '{self.name}' decides after {stage.window} windows with plans {stage.plans.shape} and {len(stage.mean)} "
                    f"entries of the record; ascending windows from {first} on, {rest} and {entries} are expected"
                )

    def __reduce__(self) -> tuple:
        return (PlanPolicy, (self.name, self.station, self.opening, self.stages, dict(self.about)))

    def memory(self, shape: int | tuple[int, ...] = ()) -> PlanMemory:
        """What is remembered at the start of as many tests: the opening.

        Args:
            shape: Number of tests m, or the shape of what stands before the last axis of the observations; () for one test.
        """
        m = int(np.prod(shape, dtype=int))
        record = np.zeros((m, self.station.n_windows, n_entries(self.station)), dtype=np.float32)
        return PlanMemory(0, record, np.tile(self.opening, (m, 1, 1)))

    def act(self, observation: NDArray[np.float32], memory: Any = None) -> NDArray[np.float32]:
        """Actions ``(…, width)`` in −1 … 1 for observations ``(…, n_observations)``.

        Args:
            observation: What was seen of the last window.
            memory: The `PlanMemory` that `memory` gave at the start of the test; brought up to date here. Tests side by side are
                equally far.

        Raises:
            ParameterError: The observations have another length, no memory came, or the test is over.
        """
        observation = np.asarray(observation, dtype=np.float32)
        station, window = self.station, memory.seen if memory is not None else 0
        rows = rows_of(self, observation, None if memory is None else len(memory.record))
        check_window(self, window)
        if window:  # what is seen first is the rest before the test
            memory.record[:, window - 1] = entries(station, rows)
        for stage in self.stages:
            if stage.window == window:
                self._decide(stage, memory)
        memory.seen += 1
        return np.clip(memory.actions[:, window], -1.0, 1.0).reshape(*observation.shape[:-1], station.width)

    def _decide(self, stage: PlanStage, memory: PlanMemory) -> None:
        record = memory.record[:, : stage.window].reshape(len(memory.record), -1)
        choice = np.argmin(stage.values(record), axis=1)
        changed = np.flatnonzero(choice)
        memory.actions[changed, stage.window :] = stage.plans[choice[changed] - 1]

    def save(self, path: Path) -> None:
        """Write the policy as a NumPy archive of plain arrays and a JSON text, whole or not at all.

        Args:
            path: Path of the file; ".npz" is appended where it does not end so.

        Raises:
            OutputError: It cannot be written.
        """
        header = {
            "format": FORMAT,
            "name": self.name,
            "station": self.station.to_dict(),
            "windows": [stage.window for stage in self.stages],
            "layers": [len(stage.weights) for stage in self.stages],
            "about": dict(self.about),
        }
        arrays = {"opening": self.opening}
        for i, stage in enumerate(self.stages):
            arrays |= {f"{name}_{i}": getattr(stage, name) for name in ("plans", "mean", "deviation")}
            for kind in ("weights", "biases"):
                arrays |= {f"{kind}_{i}_{j}": array for j, array in enumerate(getattr(stage, kind))}
        write_archive(path, "plan_document", header, arrays)


def n_entries(station: Station) -> int:
    """Entries of the record that a window gives."""
    return station.n_steps * len(station.channels) + len(station.actuators)


def entries(station: Station, observation: NDArray[np.float32]) -> NDArray[np.float32]:
    """What a window gives to the record ``(m, n_entries)``: the channels at each sample and the commands at its end, as observed."""
    measured = station.n_steps * len(station.channels)
    commands = measured + station.n_steps * len(station.actuators)
    last = observation[:, commands - len(station.actuators) : commands]
    return np.concatenate([observation[:, :measured], last], axis=1)


def plan_policy(path: Path, arrays: dict[str, NDArray[Any]], text: str) -> PlanPolicy:
    """The policy that `PlanPolicy.save` wrote.

    Args:
        path: Path of the file, for errors.
        arrays: Its arrays but for the document.
        text: The document.

    Raises:
        FileFormatError: The file is no policy, or of another format.
    """
    from bench.documents import DocumentLimits, checked, naming, parse_json  # noqa: PLC0415
    from bench.errors import FileFormatError  # noqa: PLC0415
    from bench.excitation.schema import PlanPolicyHeader  # noqa: PLC0415

    document = parse_json(text, str(path), limits=DocumentLimits(finite=False))
    header = checked(PlanPolicyHeader, document, str(path))
    stages = list(zip(header.windows, header.layers, strict=False))
    names = {"opening"}
    for i, (_, layers) in enumerate(stages):
        names |= {f"{name}_{i}" for name in ("plans", "mean", "deviation")}
        names |= {f"{kind}_{i}_{j}" for kind in ("weights", "biases") for j in range(layers)}
    if set(arrays) != names or len(header.windows) != len(header.layers):
        odd = ", ".join(sorted(set(arrays) ^ names)[:5])
        raise FileFormatError(
            f"{path} is no policy: of its arrays, {odd or 'none'} are missing or too many for decisions after {header.windows} windows"
        )
    with naming(str(path)):
        return PlanPolicy(
            header.name,
            Station.from_entry(header.station),
            arrays["opening"],
            tuple(
                PlanStage(
                    window,
                    arrays[f"plans_{i}"],
                    arrays[f"mean_{i}"],
                    arrays[f"deviation_{i}"],
                    tuple(arrays[f"weights_{i}_{j}"] for j in range(layers)),
                    tuple(arrays[f"biases_{i}_{j}"] for j in range(layers)),
                )
                for i, (window, layers) in enumerate(stages)
            ),
            header.about,
        )
