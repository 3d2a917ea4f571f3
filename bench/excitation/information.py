"""How much an excitation tells: sensitivities of measured channels to parameters, and the Fisher information in them.

The information matrix ``F = sum_t J_t' S^-1 J_t`` (J the derivatives of the channels with respect to the standardised
parameters of `bench.excitation.prior`, S the variance of the channels' white noise) is free of units. Its eigenvalues say how
many times more precisely the record knows a direction of the parameter space than the prior does: above 1 a direction is
*identifiable* from the record. The measure of an excitation is ``log det(I + F) = sum log(1 + eigenvalue)`` [nat], to which
directions that the record cannot see add nothing, whereas ``log det F`` itself falls to minus infinity with the first of them.
For a linear model and a normal prior half of it is the information gained (Lindley), and maximising it is Bayesian
D-optimality.

Derivatives are finite differences. Forces with kinks (dead-space, friction) have records that are continuous but only piecewise
smooth in the parameters; the steps are small enough for the kinks to have no part. Where a lightly damped rig is driven hard
against a dead-space, neighbouring motions part exponentially: derivatives then grow with the length of the record, all parameters
look alike, and what a long record is predicted to tell depends on the step (by several percent after ten seconds).

References:
    Fedorov 1972, "Theory of Optimal Experiments"; Chaloner, Verdinelli 1995, "Bayesian experimental design: a review",
    Statistical Science 10(3), sections 2.2 and 4; Lindley 1956, Annals of Mathematical Statistics 27(4).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.excitation.ensemble import Ensemble
from bench.excitation.prior import Draw
from bench.excitation.products import difference, dot, tile
from bench.laws.calling import advance, pointer_at
from bench.rig import Drive, controls_of, simulate_batch


class InformationLimits(NamedTuple):
    """Numbers of `bench.excitation.information` that compiled code holds."""

    step: float = 1e-4
    """Step of the finite differences in prior standard deviations. Rounding is a 1e-13th of the records, hence 1e-9 of a derivative;
    truncation is of the order of the step."""


INFORMATION_LIMITS = InformationLimits()


class Sensitivity(NamedTuple):
    """A record and its derivatives.

    Attributes:
        output: Channels ``(n, n_channels)`` in their units.
        jacobian: Derivatives with respect to the standardised parameters ``(n, n_channels, n_parameters)``.
    """

    output: NDArray[np.float64]
    jacobian: NDArray[np.float64]


class Directions(NamedTuple):
    """Directions of the standardised parameter space, best known first.

    Attributes:
        gain: Eigenvalues of the information matrix ``(n_parameters,)``.
        vectors: Eigenvectors as columns ``(n_parameters, n_parameters)``.
        identifiable: Whether the record knows the direction better than the prior ``(n_parameters,)``.
    """

    gain: NDArray[np.float64]
    vectors: NDArray[np.float64]
    identifiable: NDArray[np.bool_]


def sensitivity(
    draw: Draw,
    drive: Drive,
    *,
    channels: tuple[str, ...],
    rng: np.random.Generator | None = None,
    step: float = INFORMATION_LIMITS.step,
    central: bool = False,
    engine: Literal["compiled", "mujoco"] = "compiled",
    threads: int | None = None,
) -> Sensitivity:
    """Differentiate a rig's record with respect to its uncertain parameters.

    Args:
        draw: The rig and the parameters.
        drive: What drives it, from rest.
        channels: Names of the measured channels.
        rng: Source of randomness of an excitation.
        step: Step in prior standard deviations.
        central: Central differences, of second order and twice the price.
        engine: "compiled" (see `bench.excitation.ensemble`), or "mujoco", all perturbed rigs in one native batch: for rigs
            that the compiled ensembles refuse.
        threads: Threads of MuJoCo's batch; all cores by default.

    Raises:
        UnknownNameError: The rig does not measure such a channel, or an unknown engine.
        ModelError: The rig is not linear around its elements; use engine="mujoco".
    """
    if engine not in {"compiled", "mujoco"}:
        raise UnknownNameError("engine", engine, ("compiled", "mujoco"))
    rigs = [draw.rig, *draw.perturbed(step), *(draw.perturbed(-step) if central else ())]
    controls = controls_of(rigs[0], drive, rng)
    if engine == "compiled":
        ensemble = Ensemble(tuple(rigs), tuple(channels))
        records = ensemble.record(controls[None])[0]
    else:
        columns = dict(zip(rigs[0].actuators, controls.T, strict=True))
        recordings = simulate_batch(rigs, [columns], threads=threads)
        records = np.stack([np.stack([r[name] for name in channels], axis=1) for r in recordings])
    count = len(draw.hypothesis.parameters)
    ahead, behind = records[1 : 1 + count], records[1 + count :] if central else records[:1]
    derivatives = (ahead - behind) / (2.0 * step if central else step)
    return Sensitivity(records[0], np.moveaxis(derivatives, 0, -1))


def noise_vector(noise: Mapping[str, float], channels: tuple[str, ...]) -> NDArray[np.float64]:
    """Noise standard deviations ``(n_channels,)`` in the order of the channels.

    Raises:
        UnknownNameError: A channel has none.
        ParameterError: One is not positive.
    """
    for name in channels:
        if name not in noise:
            raise UnknownNameError("channel with a noise level", name, noise)
    values = np.array([float(noise[name]) for name in channels])
    if not (np.isfinite(values).all() and (values > 0.0).all()):
        raise ParameterError(
            f"noise levels are {dict(noise)}; positive standard deviations in the channels' units are expected"
        )
    return values


def fisher_information(sensitivity: Sensitivity, noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Information matrix ``(n_parameters, n_parameters)`` of a record.

    Args:
        sensitivity: The record's derivatives.
        noise: Standard deviation of the white noise of each channel ``(n_channels,)``, in the channels' units.
    """
    rows = (sensitivity.jacobian / noise[:, None]).reshape(-1, sensitivity.jacobian.shape[-1])
    return rows.T @ rows


def log_det(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """``log det(I + F)`` [nat] of information matrices ``(…, p, p)``; see the module for why I is added."""
    return np.linalg.slogdet(np.eye(information.shape[-1]) + information)[1]


def directions(information: NDArray[np.float64], *, threshold: float = 1.0) -> Directions:
    """Split the parameter space into directions that a record knows and directions that it does not.

    Args:
        information: Information matrix ``(n_parameters, n_parameters)``.
        threshold: Gain over the prior from which a direction counts as identifiable.
    """
    values, vectors = np.linalg.eigh(information)
    order = np.argsort(values)[::-1]
    gain = np.maximum(values[order], 0.0)
    return Directions(gain, vectors[:, order], gain > threshold)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _log_det(fisher, p, triangle):
    """``log det(I + F)`` of the leading p rows, by Cholesky's decomposition, into the scratch `triangle`."""
    total = 0.0
    for j in range(p):
        for i in range(j, p):
            value = fisher[i, j] + (1.0 if i == j else 0.0)
            for k in range(j):
                value -= triangle[i, k] * triangle[j, k]
            if i == j:
                triangle[j, j] = np.sqrt(max(value, 1.0))  # never below one but by rounding
                total += 2.0 * np.log(triangle[j, j])
            else:
                triangle[i, j] = value / triangle[j, j]
    return total


@numba.njit(cache=True, error_model="numpy", nogil=True)
def accumulate(first, last, outputs, counts, step, weights, measured, fisher, score, square, values):
    """Add the information of records of perturbed rigs to running sums, for the cases ``first … last − 1``.

    Args:
        first: First case.
        last: One past the last case.
        outputs: Records ``(n_cases, n_members, n, n_channels)``; the members are, draw after draw, the drawn rig and its
            perturbed ones.
        counts: Parameters of each draw ``(n_cases, n_draws)``, −1 for no draw.
        step: Step of the differences.
        weights: One over the noise standard deviations ``(n_channels,)``.
        measured: Measured channels ``(n_cases, n, n_channels)``; None leaves `score` and `square` as they are.
        fisher: ``sum J'J`` ``(n_cases, n_draws, p, p)``, added to.
        score: ``sum J'r`` with the residual r = measured − drawn ``(n_cases, n_draws, p)``, added to.
        square: ``sum r'r`` ``(n_cases, n_draws)``, added to.
        values: ``log det(I + F)`` ``(n_cases, n_draws)``, written.
    """
    outputs = np.ascontiguousarray(outputs)
    p_max, size = fisher.shape[2], outputs.shape[2] * outputs.shape[3]
    triangle, room = np.zeros((p_max, p_max)), np.empty((p_max + 2, size))
    rows = pointer_at(room.ctypes.data)
    residual = advance(rows, p_max * size)
    scale = advance(residual, size)
    tile(weights, 1.0 / step, size, scale)
    for case in range(first, last):
        record = pointer_at(outputs.ctypes.data + 8 * size * outputs.shape[1] * case)
        for draw in range(counts.shape[1]):
            p = counts[case, draw]
            if p < 0:
                break
            own = fisher[case, draw]
            for j in range(p):
                row = advance(rows, j * size)
                difference(advance(record, (1 + j) * size), record, scale, size, row)
                for k in range(j + 1):
                    own[j, k] += dot(row, advance(rows, k * size), size)
                    own[k, j] = own[j, k]
            if measured is not None:
                for i in range(outputs.shape[2]):
                    for c in range(weights.size):
                        at = i * weights.size + c
                        residual[at] = weights[c] * (measured[case, i, c] - record[at])
                square[case, draw] += dot(residual, residual, size)
                for j in range(p):
                    score[case, draw, j] += dot(advance(rows, j * size), residual, size)
            values[case, draw] = _log_det(own, p, triangle)
            record = advance(record, (1 + p) * size)
    room[0, 0] = 0.0  # an array of which only the address is in use would be freed before


def misfit(
    fisher: NDArray[np.float64], score: NDArray[np.float64], square: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Whitened squared residual of records under drawn rigs after the best linear correction of their parameters ``(…)``.

    ``r'r - g'(I + F)^-1 g`` with ``g = J'r``: the exponent of the marginal likelihood ``N(r; 0, I + J J')``, times −2.

    Args:
        fisher: Information matrices ``(…, p, p)``.
        score: ``(…, p)``.
        square: ``(…)``.
    """
    inner = np.eye(fisher.shape[-1]) + fisher
    explained = np.einsum("...i,...i->...", score, np.linalg.solve(inner, score[..., None])[..., 0])
    return np.maximum(square - explained, 0.0)
