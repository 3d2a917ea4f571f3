"""Network model of a joint: a tanh hidden layer trained by Levenberg-Marquardt with Bayesian regularisation.

The procedure is that of the dissertation's section 4.1.4: inputs and outputs scaled to ±1 over all records, training in
stages (part of the data to a loose tolerance, then twice the data and half the tolerance, until all is in use), several
random starts, the scaling folded into the weights at the end (appendix A). What differs, and why:

- The starts are not all trained to the end: after each stage only the better half by validation error goes on.
- "All" the data means `max_samples` of it, drawn evenly over the states visited rather than over time. Records dwell
  near rest: on 4000 random samples of the joint rig's records the error over the whole records was up to five times
  that over the samples, on as many spread ones never above 1.2 times. It matters because what is wrong in the corners
  can diverge in closed loop.
- Output weights start at their least-squares values, since the cost is linear in them.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from bench.errors import FileFormatError, IdentificationError, ParameterError
from bench.identification.fit_data import centre_and_scale, checked_data, nmse_percent, read_only
from bench.identification.hidden_layer import HiddenLayerProblem
from bench.identification.network_training import (
    RandomStart,
    Training,
    TrainingData,
    TrainingProgress,
    held_out_split,
    spread_order,
    train,
)
from bench.identification.polynomial import slopes_beyond
from bench.identification.validity_range import ValidityRange
from bench.laws.base import ForceLaw
from bench.laws.network import NetworkWeights, fold_scaling, network_law, published_network

__all__ = ["NetworkModel", "NetworkReport", "TrainingProgress", "fit_network", "published_network"]


@dataclass(frozen=True)
class NetworkReport:
    """How a training went.

    Attributes:
        nmse: Normalised mean-square error of each output on all data given [%].
        nmse_validation: The same on the segments held out [%]; empty without any.
        n_weights: Number of weights and biases.
        effective_parameters: Number of them determined by the data (MacKay's gamma).
        alpha: Precision of the weights' prior, on normalised data.
        beta: Precision of the residuals, on normalised data.
        n_samples: Number of samples trained on in the last stage.
        iterations: Accepted steps of the winning start, all stages together.
        starts: Validation error of each start after the last stage it took part in, mean of the outputs [%].
        stopped: Why the last stage ended: "target", "stall", "iterations", "time" or "damping".
        seconds: Time taken [s].
    """

    nmse: tuple[float, ...]
    nmse_validation: tuple[float, ...]
    n_weights: int
    effective_parameters: float
    alpha: float
    beta: float
    n_samples: int
    iterations: int
    starts: tuple[float, ...]
    stopped: str
    seconds: float


@dataclass(frozen=True)
class NetworkModel:
    """A trained network in physical units, with its range of validity.

    Attributes:
        weights: Weights on states (and accelerations, where the mass was unknown), in SI units.
        range: Range of the states it was identified from.
        report: How the training went.
        mass: Mean mass matrix (k, k) seen by the network [kg, kg m²], where it was trained on accelerations.
        mass_std: Standard deviation of it over the samples (k, k) [kg, kg m²]: a network need not be linear in the
            acceleration, and this says how far it is from it.
        beyond: Stiffness and damping (2, k) [N/m, N m/rad; N s/m, N m s/rad] of a bounded network beyond its range, or None.
    """

    weights: NetworkWeights = field(repr=False)
    range: ValidityRange
    report: NetworkReport
    mass: NDArray[np.float64] | None = None
    mass_std: NDArray[np.float64] | None = None
    beyond: NDArray[np.float64] | None = None

    @cached_property
    def joint(self) -> NetworkWeights:
        """Weights on the states alone: the network at zero acceleration."""
        W1, b1, W2, b2 = self.weights
        return NetworkWeights(read_only(W1[:, : 2 * len(b2)]), b1, W2, b2)

    @cached_property
    def law(self) -> ForceLaw:
        """The law whose parameters are the weights."""
        box = None if self.beyond is None else (self.range.minimum, self.range.maximum)
        return network_law(len(self.weights.b2), len(self.weights.b1), box=box)

    @cached_property
    def theta(self) -> NDArray[np.float64]:
        """Header and weights, as an element takes them."""
        beyond = () if self.beyond is None else self.beyond.ravel()
        return read_only(self.law.theta(np.concatenate([self.joint.flat(), beyond])))

    def predict(self, states: ArrayLike) -> NDArray[np.float64]:
        """Restoring forces (n, k) [N, N m] at states (n, 2 k) [m, rad, m/s, rad/s]."""
        data = np.atleast_2d(np.asarray(states, dtype=float))
        if self.beyond is None:
            return self.joint(data)
        inside = np.clip(data, self.range.minimum, self.range.maximum)
        outside = (data - inside) * self.beyond.ravel()
        k = len(self.weights.b2)
        return self.joint(inside) + outside[:, :k] + outside[:, k:]

    def bounded(self, forces: ArrayLike) -> NetworkModel:
        """The same network held at the edge of its range, with a spring and a damper beyond.

        Args:
            forces: Restoring forces (n, k) [N, N m] it was identified from; beyond, the largest is outweighed within half a range.
        """
        half = centre_and_scale(np.stack([self.range.minimum, self.range.maximum]))[1]
        return replace(self, beyond=slopes_beyond(np.asarray(forces, dtype=float), half))

    def to_json(self) -> str:
        """The model as JSON text; numbers survive to the last bit."""
        values = {
            "type": "network",
            "weights": {name: part.tolist() for name, part in self.weights._asdict().items()},
            "range": self.range.to_dict(),
            "report": vars(self.report),
            "mass": None if self.mass is None else self.mass.tolist(),
            "mass_std": None if self.mass_std is None else self.mass_std.tolist(),
            "beyond": None if self.beyond is None else self.beyond.tolist(),
        }
        return json.dumps(values)

    @classmethod
    def from_json(cls, text: str) -> NetworkModel:
        """The model from the text of `to_json`.

        Raises:
            FileFormatError: The text is not that of a network model.
        """
        try:
            values = json.loads(text)
            if values["type"] != "network":
                raise FileFormatError(f"a model of type '{values['type']}' came; 'network' is expected")
            weights = NetworkWeights(*(read_only(values["weights"][name]) for name in NetworkWeights._fields))
            report = values["report"]
            lists = {name: tuple(report[name]) for name in ("nmse", "nmse_validation", "starts")}
            rest = ("mass", "mass_std", "beyond")
            given = [None if values.get(name) is None else read_only(values[name]) for name in rest]
            return cls(
                weights,
                ValidityRange.from_dict(values["range"]),
                NetworkReport(**report | lists),
                *given,
            )
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, FileFormatError):
                raise
            raise FileFormatError(f"this is no network model written by `to_json`: {error}") from error


class _Scaling(NamedTuple):
    """Centre and half-range of the inputs (n_inputs,) and the outputs (n_outputs,), in physical units."""

    input_centre: NDArray[np.float64]
    input_scale: NDArray[np.float64]
    output_centre: NDArray[np.float64]
    output_scale: NDArray[np.float64]


def fit_network(
    states: ArrayLike,
    forces: ArrayLike,
    *,
    rng: np.random.Generator,
    n_hidden: int = 30,
    n_restarts: int = 4,
    n_stages: int = 3,
    max_samples: int | None = 12_000,
    max_iterations: int = 250,
    tolerance: float = 0.005,
    regularise: bool = True,
    bounded: bool = False,
    validation_fraction: float = 0.1,
    accelerations: ArrayLike | None = None,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: TrainingProgress | None = None,
) -> NetworkModel:
    """Train a network on states and forces.

    Args:
        states: Relative states ``(n, 2 k)``, displacements before velocities [m, rad, m/s, rad/s]; records one after
            the other. Three records (each joint alone, then both) are needed for two coupled joints.
        forces: Restoring forces ``(n, k)`` [N, N m]; with `accelerations`, applied forces less mounts.
        rng: Source of the random starts and of the choice of samples.
        n_hidden: Number of tanh units.
        n_restarts: Number of random starts.
        n_stages: Number of stages; each doubles the samples and halves the tolerance.
        max_samples: Most samples of the last stage; None for all.
        max_iterations: Most accepted steps of the last stage; the earlier ones have half as many.
        tolerance: Normalised mean-square error at which the last stage ends [%].
        regularise: Whether the weights have a prior estimated from the evidence.
        bounded: Whether the network is held at the edge of its range, with a spring and a damper beyond it as a bounded polynomial has:
            what it would say out there depends on the start that happened to win, and closed loops run away on it.
        validation_fraction: Fraction of the samples held out, in twenty segments, to choose between the starts [1].
        accelerations: Absolute accelerations ``(n, k)`` [m/s², rad/s²] of the body the forces act on, where its mass
            is unknown: they become inputs, and the joint is the network at zero acceleration.
        time_limit: Time to stop after [s]; the result then depends on the machine.
        threads: Number of threads; all cores if None. It does not change the result.
        progress: Called after each step.

    Returns:
        The best network by validation error, in physical units.

    Raises:
        IdentificationError: Arrays do not fit, are not finite, are constant or too short.
        ParameterError: A setting is out of range.

    References:
        Tasbihgoo 2006, sections 4.1.4 and 4.5, appendix A; Masri et al. 1992 (stages).
    """
    begun = time.monotonic()
    s, f, a = checked_data(states, forces, accelerations)
    counts = {
        "n_hidden": n_hidden,
        "n_restarts": n_restarts,
        "n_stages": n_stages,
        "max_iterations": max_iterations,
    }
    _check(s, f, counts, validation_fraction)
    raw = np.hstack([s, a])
    scaling = _Scaling(*centre_and_scale(raw), *centre_and_scale(f))
    fitted, held_out = held_out_split(len(s), validation_fraction, rng)
    inputs = (raw - scaling.input_centre) / scaling.input_scale
    order = spread_order(inputs, fitted, rng)
    data = TrainingData(inputs, (f - scaling.output_centre) / scaling.output_scale, order, held_out)
    most = len(order) if max_samples is None else min(max_samples, len(order))
    sizes = tuple(max(most >> (n_stages - 1 - stage), min(100, most)) for stage in range(n_stages))
    limit = math.inf if time_limit is None else time_limit
    training = Training(n_hidden, n_restarts, sizes, tolerance, max_iterations, regularise, limit, progress)
    # One BLAS thread each: OpenBLAS' own threads gain nothing at this size and spin when another process is busy,
    # which made an iteration ten times slower.
    with threadpool_limits(1, user_api="blas"), ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        starts = train(data, training, rng, pool.map)
    weights = _in_physical_units(starts[0].weights, data, n_hidden, scaling)
    judged = held_out if len(fitted) < len(s) else None
    report = _report(starts, f, weights(raw), judged, n_samples=sizes[-1], seconds=time.monotonic() - begun)
    mass, deviation = _mass(weights, raw[order[:most]]) if a.shape[1] else (None, None)
    model = NetworkModel(weights, ValidityRange.of(s), report, mass, deviation)
    return model.bounded(f) if bounded else model


def _check(
    states: NDArray[np.float64],
    forces: NDArray[np.float64],
    counts: Mapping[str, int],
    fraction: float,
) -> None:
    """Raise an error for settings or data that nothing can be learnt from."""
    if min(counts.values()) < 1 or not 0.0 <= fraction <= 0.5:
        raise ParameterError(
            f"{', '.join(f'{name} {count}' for name, count in counts.items())} and validation_fraction {fraction:g} came; "
            "at least 1 each, and a fraction in [0, 0.5] are expected"
        )
    if len(states) < 100:
        raise IdentificationError(
            f"{len(states)} samples came; at least 100 are expected to train and validate a network"
        )
    if not np.any(np.ptp(forces, axis=0) > 0.0):
        raise IdentificationError("all forces are constant; there is nothing to learn from these records")


def _in_physical_units(
    flat: NDArray[np.float64], data: TrainingData, n_hidden: int, scaling: _Scaling
) -> NetworkWeights:
    """Weights on physical units, from those on normalised data as a minimisation leaves them."""
    A, B = HiddenLayerProblem(data.inputs[:1], data.outputs[:1], n_hidden).unpack(flat)
    folded = fold_scaling(
        NetworkWeights(A[:-1].T, A[-1], B[:, :-1], B[:, -1]),
        scaling.input_centre,
        scaling.input_scale,
        output_centre=scaling.output_centre,
        output_scale=scaling.output_scale,
    )
    return NetworkWeights(*(read_only(part) for part in folded))


def _report(
    starts: list[RandomStart],
    forces: NDArray[np.float64],
    estimated: NDArray[np.float64],
    held_out: NDArray[np.int64] | None,
    *,
    n_samples: int,
    seconds: float,
) -> NetworkReport:
    """How the training went, from its starts, the best first."""
    best = starts[0]
    assert best.minimum is not None
    return NetworkReport(
        nmse=nmse_percent(forces, estimated),
        nmse_validation=() if held_out is None else nmse_percent(forces[held_out], estimated[held_out]),
        n_weights=len(best.weights),
        effective_parameters=best.minimum.effective_parameters,
        alpha=best.minimum.alpha,
        beta=best.minimum.beta,
        n_samples=n_samples,
        iterations=best.iterations,
        starts=tuple(start.error for start in sorted(starts, key=lambda start: start.number)),
        stopped=best.minimum.stopped,
        seconds=seconds,
    )


def _mass(
    weights: NetworkWeights, inputs: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and standard deviation over the samples of the derivative by the accelerations, (k, k) each."""
    k = len(weights.b2)
    slope = 1.0 - np.tanh(inputs @ weights.W1.T + weights.b1) ** 2
    derivative = np.einsum("oj,nj,ja->noa", weights.W2, slope, weights.W1[:, 2 * k :], optimize=True)
    return read_only(derivative.mean(axis=0)), read_only(derivative.std(axis=0))
