"""Grid points of a screening: what spans an effect at one shape, and the parameters that a least-squares solution stands for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.settings import ScreeningSettings

TINY = -60.0
"""Value of eta that makes a positive amplitude vanish."""


@dataclass(frozen=True)
class LinearAmplitudesSettings:
    """Numbers of `bench.discrepancy.screening.linear_amplitudes`."""

    rows: int = 8192
    """Rows of two matrices that are multiplied at once."""


LINEAR_AMPLITUDES_SETTINGS = LinearAmplitudesSettings()


class GridPoint(NamedTuple):
    """A grid point of an effect.

    Attributes:
        placed: The effect.
        eta: Parameters with unit amplitude.
        columns: (n, k) whitened responses that span the effect at this shape, in single precision.
        gram: (k, k) their products.
    """

    placed: Placed
    eta: Array
    columns: NDArray[np.floating]
    gram: Array


def amplitudes(placed: Placed) -> list[int]:
    """Indices of the parameters that an effect's force is linear in, or their logarithms."""
    count = placed.effect.n_linear or placed.effect.n_coordinates
    return [i for i, p in enumerate(placed.effect.parameters) if i < count and not p.grid]


def spanning(placed: Placed, eta: Array) -> list[Array]:
    """Parameter points whose responses span the effect at one shape."""
    effect = placed.effect
    unit = eta.copy()
    linear = amplitudes(placed)
    for i in linear:
        unit[i] = 1.0 if effect.parameters[i].signed else 0.0
    if effect.modulated:
        still, sine, cosine = unit.copy(), unit.copy(), unit.copy()
        still[1], sine[1], cosine[1] = TINY, 0.0, 0.0
        sine[3], cosine[3] = 0.0, 0.5 * np.pi
        return [still, sine, cosine]
    if effect.affine:
        without, with_one = unit.copy(), unit.copy()
        without[1], with_one[1] = TINY, 0.0
        return [without, with_one]
    points = []
    for i in linear:
        single = unit.copy()
        for j in linear:
            if j != i:
                single[j] = 0.0 if effect.parameters[j].signed else TINY
        points.append(single)
    return points


def products(a: NDArray[np.floating], b: NDArray[np.floating]) -> Array:
    """Products (k, m) of the columns of two matrices (n, k) and (n, m), summed in double precision without a copy of either."""
    total = np.zeros((a.shape[1], b.shape[1]))
    for first in range(0, len(a), LINEAR_AMPLITUDES_SETTINGS.rows):
        x, y = (
            m[first : first + LINEAR_AMPLITUDES_SETTINGS.rows].astype(np.float64, copy=False) for m in (a, b)
        )
        total += x.T @ y
    return total


def fainter(placed: Placed, eta: Array, share: float) -> Array:
    """Parameters (n,) of an effect whose force is a `share` of that with others (n,)."""
    out = eta.copy()
    for i in amplitudes(placed):
        out[i] = share * eta[i] if placed.effect.parameters[i].signed else eta[i] + np.log(share)
    return out


def read(node: GridPoint, gram: Array, right: Array, *, settings: ScreeningSettings) -> Point | None:  # noqa: PLR0912  (one branch a kind of effect)
    """Best coefficients of a node, and the parameters they stand for; None where their sign makes no sense."""
    effect = node.placed.effect
    parameters = effect.parameters
    eta = node.eta.copy()
    # what is left of a memory beside stiffness and damping is small, but it is all that tells it
    if gram.trace() <= settings.imitated * max(node.gram.trace(), 1e-300):
        return None
    # beside a base whose own run diverges when it is moved
    if not (np.isfinite(gram).all() and np.isfinite(right).all()):
        return None
    c = np.linalg.lstsq(gram, right, rcond=1e-10)[0]
    if effect.site in {"actuator", "sensor"}:
        if parameters[0].fixed:  # all of it or nothing
            c = np.ones(1)
            if 2.0 * right[0] <= gram[0, 0]:
                return None
        elif parameters[0].signed:
            eta[0] = np.clip(settings.signal_step * c[0], *parameters[0].bounds)
        elif c[0] <= 0:
            return None
    elif effect.modulated:
        if c[0] <= 0:
            return None
        eta[0] = np.log(c[0])
        eta[1] = np.log(max(np.hypot(c[1], c[2]) / c[0], 1e-6))
        eta[3] = np.arctan2(c[2], c[1])
    elif effect.affine:
        if c[0] <= 0 or c[1] <= 0:
            # noise in the motion can turn the sign of what comes on top: then as much of it as is usual
            usual = np.array([1.0, np.exp(parameters[1].mean)])
            c = usual * (usual @ right) / (usual @ gram @ usual)
            if c[0] <= 0:
                return None
        eta[0], eta[1] = np.log(c[0]), np.log(c[1] / c[0])
    else:
        for position, i in enumerate(amplitudes(node.placed)):
            if parameters[i].signed:
                eta[i] = c[position]
            elif c[position] > 0:
                eta[i] = np.log(c[position])
            elif len(c) == 1:
                return None
            else:
                c[position] = 0.0
                eta[i] = -7.0
    low = np.array([p.bounds[0] for p in parameters])
    high = np.array([p.bounds[1] for p in parameters])
    gain = float(2.0 * c @ right - c @ gram @ c)
    return Point(node.placed, gain, np.clip(eta, low, high))
