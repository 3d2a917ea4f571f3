"""What the numbers of a body change in the equations of the joints: mass, moment of inertia, centre of mass; and what gravity does.

A body is a point mass m at its centre c and an inertia about it. Of the point, torques and inertias along a given motion are a quadratic
polynomial of where it lies; of the inertia they are linear. So along that motion

    change = (m + dm) P(c + dc) - m P(c) + dI R,   P(c + dc) = P(c) + G dc + dc' H dc / 2,

which is exact however large the changes are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.model import ArticulatedModel, Dynamics
from bench.rig.bodies import AXES, BODIES
from bench.rig.gravity import tilted


@dataclass(frozen=True)
class BodyTermsSettings:
    """Numbers of `bench.discrepancy.multibody.body_terms`."""

    rounding: float = 1e-9
    """What a joint feels of a body, over what the joint does that feels it most, that differences of inverse dynamics make of nothing."""


SETTINGS = BodyTermsSettings()


@dataclass(frozen=True, eq=False)
class BodyTerms:
    """A body whose numbers are uncertain; arrays begin with an axis of joints, or have none for one joint.

    Attributes:
        mass: Its mass [kg].
        axes: Uncertain coordinates of its centre of mass.
        terms: (2 + n_axes + n_axes^2, …, 2, n_steps) changes of bias and inertia: P(c), by a kilogram at its centre of mass, R, by a unit
            of its moment of inertia (zeros where that is certain), G and H.
        felt: (n_joints,), or of one joint: whether anything of it is more there than rounding, beside the joint that feels it most.
    """

    mass: float
    axes: tuple[str, ...]
    terms: Array
    felt: NDArray[np.bool_]

    def of_joint(self, j: int) -> BodyTerms:
        """The terms of joint `j`."""
        return replace(self, terms=np.ascontiguousarray(self.terms[:, j]), felt=self.felt[j])

    def change(self, coefficients: Array, by: Mapping[str, float]) -> None:
        """Change bias and inertia (2, n_steps), in place, by the numbers changed by `by`, a kind of `BODIES` to its change."""
        shift, more = np.array([by.get(axis, 0.0) for axis in self.axes]), by.get("mass", 0.0)
        moved = (self.mass + more) * np.concatenate([shift, 0.5 * np.outer(shift, shift).ravel()])
        add_multiples(coefficients, np.concatenate([[more, by.get("inertia", 0.0)], moved]), self.terms)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def add_multiples(out: Array, factors: Array, terms: Array) -> None:
    """Add multiples by factors (k,) of terms (k, 2, n) to `out` (2, n)."""
    for k in range(len(factors)):
        if factors[k] != 0.0:
            for i in range(out.shape[0]):
                for j in range(out.shape[1]):
                    out[i, j] += factors[k] * terms[k, i, j]


class GravityTerms(NamedTuple):
    """What the direction of gravity changes in the equation of a joint.

    Attributes:
        vector: (3,) as the model has it [m/s^2].
        terms: (3, …, n_steps) bias by a unit of it along each axis of the model.
    """

    vector: Array
    terms: Array

    def of_joint(self, j: int) -> GravityTerms:
        """The terms of joint `j`."""
        return GravityTerms(self.vector, np.ascontiguousarray(self.terms[:, j]))

    def change(self, x: float, y: float) -> Array:
        """Change (n_steps,) of the bias on a base that leans, see `tilted`."""
        return (tilted(self.vector, x, y) - self.vector) @ self.terms


def gravity_terms(
    model: ArticulatedModel, motion: tuple[Array, Array, Array], beside: Callable[[Dynamics], Array]
) -> GravityTerms:
    """The terms (3, n_joints, n_steps) of gravity along a motion, `beside` as for `body_terms`."""
    pulled = [beside(model.with_gravity(model.gravity + axis).dynamics(*motion))[:, 0] for axis in np.eye(3)]
    return GravityTerms(model.gravity, np.stack(pulled))


def body_terms(
    case: Case,
    model: ArticulatedModel,
    motion: tuple[Array, Array, Array],
    beside: Callable[[Dynamics], Array],
) -> dict[str, BodyTerms]:
    """The terms (n_joints, 2, n_steps) of every body with uncertain numbers.

    Args:
        case: For what is uncertain; what names no body of the model is left to others to refuse.
        model: The model at its nominal numbers.
        motion: Position, velocity and acceleration (n, n_moving).
        beside: Takes inverse dynamics along the motion to what they change (n_joints, 2, n_steps) in the equations.
    """
    stated: dict[str, dict[str, float]] = {}
    for parameter in case.parameters:
        kind, _, body = parameter.name.partition(":")
        if kind in BODIES and body in model.bodies and parameter.std > 0.0:
            stated.setdefault(body, {})[kind] = parameter.std
    return {body: _terms(model, body, std, motion, beside) for body, std in stated.items()}


def _terms(
    model: ArticulatedModel,
    body: str,
    std: Mapping[str, float],
    motion: tuple[Array, Array, Array],
    beside: Callable[[Dynamics], Array],
) -> BodyTerms:
    axes = tuple(axis for axis in AXES if axis in std)
    centre = np.array([model.body_value(axis, body) for axis in AXES])
    # a polynomial of degree two is known from differences over any step
    steps = [std[axis] * np.eye(3)[AXES.index(axis)] for axis in axes]

    def point(at: Array) -> Array:
        return beside(model.with_payload(body, 1.0, centre + at).dynamics(*motion))

    here = point(np.zeros(3))
    ahead, behind = [point(step) for step in steps], [point(-step) for step in steps]
    slopes, curvatures = [], np.zeros((len(axes), len(axes), *here.shape))
    for i, axis in enumerate(axes):
        slopes.append((ahead[i] - behind[i]) / (2.0 * std[axis]))
        curvatures[i, i] = (ahead[i] + behind[i] - 2.0 * here) / std[axis] ** 2
        for k, other in enumerate(axes[:i]):
            both = point(steps[i] + steps[k]) - ahead[i] - ahead[k] + here
            curvatures[i, k] = curvatures[k, i] = both / (std[axis] * std[other])
    moment = np.zeros_like(here)
    if "inertia" in std:
        more = model.with_body("inertia", body, model.body_value("inertia", body) + std["inertia"])
        moment = beside(more.dynamics(*motion)) / std["inertia"]
    terms = np.stack([here, moment, *slopes, *(row for block in curvatures for row in block)])
    largest = np.abs(terms).max(axis=(2, 3))
    felt = np.any(
        largest > SETTINGS.rounding * np.maximum(largest.max(axis=1, keepdims=True), 1e-300), axis=0
    )
    return BodyTerms(model.mass(body), axes, terms, felt)
