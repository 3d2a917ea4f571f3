"""Training of a network in stages: which samples, from which starts, and which of these go on."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.identification.hidden_layer import HiddenLayerProblem
from bench.identification.levenberg_marquardt import RegularisedMinimum, minimise_regularised

TrainingProgress = Callable[[str, int, float], None]
"""Called with the stage ("stage 1/3, start 2/4"), the iteration and the normalised mean-square error [%]."""


@dataclass(frozen=True)
class NetworkSettings:
    """Numbers of `bench.identification.network`."""

    cells: int = 12


SETTINGS = NetworkSettings()


class TrainingData(NamedTuple):
    """What is trained on, and what is held out."""

    inputs: NDArray[np.float64]  # normalised (n, n_inputs)
    outputs: NDArray[np.float64]  # normalised (n, n_outputs)
    order: NDArray[
        np.int64
    ]  # samples to train on, the first n of which are spread over the states for every n
    held_out: NDArray[np.int64]  # samples to choose between starts; all of them where none was held out


class Training(NamedTuple):
    """How it is trained."""

    n_hidden: int
    n_starts: int
    sizes: tuple[int, ...]  # samples of each stage
    tolerance: float  # of the last stage [%]
    max_iterations: int
    regularise: bool
    time_limit: float
    progress: TrainingProgress | None


@dataclass
class RandomStart:
    """One random start, and how far it has come."""

    number: int
    weights: NDArray[np.float64]
    minimum: RegularisedMinimum | None = None
    error: float = math.inf
    iterations: int = 0


def train(
    data: TrainingData, training: Training, rng: np.random.Generator, run: Callable[..., Iterable]
) -> list[RandomStart]:
    """All stages; the starts with the best first."""
    clock = time.monotonic()
    variance = float(np.sum(np.var(data.outputs, axis=0)))
    judge = HiddenLayerProblem(
        data.inputs[data.held_out], data.outputs[data.held_out], training.n_hidden, run=run
    )
    last = len(training.sizes) - 1
    starts: list[RandomStart] = []
    retired: list[RandomStart] = []
    for stage, size in enumerate(training.sizes):
        chosen = data.order[:size]
        problem = HiddenLayerProblem(data.inputs[chosen], data.outputs[chosen], training.n_hidden, run=run)
        if stage == 0:
            starts = [RandomStart(i, problem.random_weights(rng)) for i in range(training.n_starts)]
        percent = 100.0 / (size * variance)
        remaining = clock + training.time_limit * 0.5 ** (last - stage) - time.monotonic()
        for turn, start in enumerate(starts):
            label = f"stage {stage + 1}/{last + 1}, start {start.number + 1}/{training.n_starts}"
            start.minimum = minimise_regularised(
                problem,
                start.weights,
                max_iterations=training.max_iterations
                if stage == last
                else max(training.max_iterations // 2, 1),
                target=training.tolerance * 2.0 ** (last - stage) / percent,
                regularise=training.regularise,
                decay=1e-6 if start.minimum is None else start.minimum.alpha / start.minimum.beta,
                deadline=time.monotonic() + remaining / (len(starts) - turn)
                if math.isfinite(remaining)
                else math.inf,
                on_iteration=_reporter(training.progress, label, percent),
            )
            remaining = clock + training.time_limit * 0.5 ** (last - stage) - time.monotonic()
            start.weights = start.minimum.weights
            start.iterations += start.minimum.iterations
            start.error = 100.0 * judge.sum_of_squares(start.weights) / (len(data.held_out) * variance)
        starts.sort(key=lambda start: start.error)
        kept = len(starts) if stage == last else (1 if stage == last - 1 else math.ceil(len(starts) / 2))
        retired = starts[kept:] + retired
        starts = starts[:kept]
    return starts + retired


def _reporter(
    progress: TrainingProgress | None, label: str, percent: float
) -> Callable[[int, float], None] | None:
    if progress is None:
        return None
    return lambda iteration, squares: progress(label, iteration, percent * squares)


def held_out_split(
    n: int, fraction: float, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Samples to train on, and those held out: one stretch at a random place in each of twenty segments.

    Stretches, because neighbouring samples of a record are nearly the same sample.
    """
    everything = np.arange(n)
    if fraction == 0.0:
        return everything, everything
    held_out = np.zeros(n, dtype=bool)
    edges = np.linspace(0, n, 21).astype(int)
    for first, end in itertools.pairwise(edges):
        length = max(round(fraction * (end - first)), 1)
        begin = first + int(rng.integers(end - first - length + 1))
        held_out[begin : begin + length] = True
    return everything[~held_out], everything[held_out]


def spread_order(
    inputs: NDArray[np.float64], samples: NDArray[np.int64], rng: np.random.Generator
) -> NDArray[np.int64]:
    """The samples in an order whose every beginning covers the states: extremes first, then a weighted shuffle.

    A sample's weight is the inverse square root of the number of samples in its cell, half-way between evenly in time
    and evenly over the cells; the latter (and its neighbourhood) trained slower and was no safer.
    """
    points = inputs[samples]
    n_inputs = points.shape[1]
    cells = max(min(SETTINGS.cells, int(2.0 ** (62.0 / n_inputs))), 1)
    index = np.clip(((points + 1.0) * 0.5 * cells).astype(np.int64), 0, cells - 1)
    _, member, count = np.unique(
        index @ (cells ** np.arange(n_inputs)), return_inverse=True, return_counts=True
    )
    key = np.log(rng.random(len(points))) * np.sqrt(
        count[member]
    )  # Efraimidis and Spirakis 2006, in logarithms
    key[np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])] = 0.0
    return samples[np.argsort(-key, kind="stable")]
