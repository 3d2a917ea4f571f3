"""Families: the rigs of one hypothesis at any parameters, many at a time, without compiling each.

An `Ensemble` is made from rigs, each with a compiled MuJoCo model; identifications and closed loops need thousands of rigs
that differ in their parameters only. The rows of a packed ensemble are affine in the parameters' values (stiffness and damping
enter the accelerations so, and a law's own parameters are copied), so that two rigs a parameter tell them all. A parameter of
which that is not true, as a mass, is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.errors import ModelError
from bench.excitation.ensemble import Ensemble
from bench.excitation.prior import RigHypothesis
from bench.excitation.stepping import Packed, integrate_cases


@dataclass(frozen=True)
class FamilySettings:
    """Numbers of `bench.excitation.family`."""

    agreement: float = 1e-9
    """Of the largest coefficient: what is affine agrees to 1e-13."""


SETTINGS = FamilySettings()

_AFFINE = ("constants", "coefficients", "theta")
_SAME = tuple(name for name in Packed._fields if name not in {"rows", "columns", *_AFFINE})


@dataclass(eq=False)
class Family:
    """The rigs of a hypothesis as a function of its standardised parameters.

    Attributes:
        hypothesis: The hypothesis.
        channels: Measured channels that records hold.
        actuators: Driven actuators.

    Raises:
        ModelError: The rig is not linear around its elements, or not affine in an uncertain parameter.
    """

    hypothesis: RigHypothesis
    channels: tuple[str, ...]
    actuators: tuple[str, ...]
    _packed: Packed = field(init=False, repr=False)
    _slopes: dict[str, NDArray[np.float64]] = field(
        init=False, repr=False
    )  # (p, size of a rig's rows) by a unit

    def __post_init__(self) -> None:
        self.channels, self.actuators = tuple(self.channels), tuple(self.actuators)
        p = self.n_parameters
        check = np.linspace(-1.5, 1.2, p)
        places = np.concatenate([np.zeros((1, p)), 1.7 * np.eye(p), check[None]])
        rigs = tuple(self.hypothesis.at(row).rig for row in places)
        packed = Ensemble(rigs, self.channels, self.actuators).packed
        self._places = (
            np.array([parameter.range for parameter in self.hypothesis.parameters]).reshape(-1, 2).T
        )
        self._logarithmic = np.array(
            [item.scale == "logarithmic" for item in self.hypothesis.parameters], dtype=bool
        )
        values = self.values(places)
        self._slopes = {}
        for name in _AFFINE:
            rows = getattr(packed, name)
            change = np.diag(values[1:-1] - values[0])[:, None]
            self._slopes[name] = (rows[1:-1] - rows[0]).reshape(p, -1) / change
        self._middle = values[0]
        self._packed = packed.alone(0)
        found = self.packed(check[None])
        for name in _AFFINE:
            given, ours = getattr(packed, name)[-1], getattr(found, name)[0]
            if np.max(np.abs(given - ours), initial=0.0) > SETTINGS.agreement * np.max(
                np.abs(given), initial=1e-300
            ):
                raise ModelError(
                    f"hypothesis '{self.hypothesis.name}' is not affine in its parameters {', '.join(self.hypothesis.names)}; "
                    "stiffnesses, dampings and parameters of laws are, masses and inertias are not: make those known"
                )

    def __reduce__(self) -> tuple:
        return (
            Family,
            (self.hypothesis, self.channels, self.actuators),
        )  # addresses of kernels hold in one process

    @property
    def n_parameters(self) -> int:
        """Number of uncertain parameters."""
        return len(self.hypothesis.parameters)

    @property
    def n_states(self) -> int:
        """Number of states of a rig."""
        return self._packed.start.shape[1]

    @property
    def timestep(self) -> float:
        """Integration step, and interval of the records [s]."""
        return self.hypothesis.rig.timestep

    def values(self, coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of the parameters ``(…, p)`` at standardised coordinates ``(…, p)``."""
        middle, spread = self._places
        place = middle + spread * coordinates
        return np.where(self._logarithmic, np.exp(np.where(self._logarithmic, place, 0.0)), place)

    def packed(self, coordinates: NDArray[np.float64]) -> Packed:
        """Rigs at standardised coordinates ``(n_rigs, p)`` for `bench.excitation.ensemble.integrate_cases`."""
        n, base = len(coordinates), self._packed
        offsets = self.values(coordinates) - self._middle
        affine = {
            name: rows + (offsets @ self._slopes[name]).reshape(n, *rows.shape[1:])
            for name, rows in zip(_AFFINE, (base.constants, base.coefficients, base.theta), strict=True)
        }
        return base._replace(**affine, **{name: getattr(base, name).repeat(n, axis=0) for name in _SAME})

    def record(self, coordinates: NDArray[np.float64], controls: NDArray[np.float64]) -> NDArray[np.float64]:
        """Records from rest of several rigs under each of several drives.

        Args:
            coordinates: Standardised parameters ``(n_cases, n_rigs, p)``.
            controls: Commands ``(n_cases, n, n_actuators)``.

        Returns:
            ``(n_cases, n_rigs, n, n_channels)``.
        """
        cases, rigs, p = coordinates.shape
        packed = self.packed(coordinates.reshape(-1, p))
        states = packed.start.reshape(cases, rigs, -1).copy()
        members = np.arange(cases * rigs).reshape(cases, rigs)
        return integrate_cases(
            packed, controls, states, members=members, counts=np.full(cases, rigs), timestep=self.timestep
        )


def fans(coordinates: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Each point followed by itself moved by `step` along one coordinate after the other ``(…, 1 + p, p)``."""
    p = coordinates.shape[-1]
    return coordinates[..., None, :] + step * np.concatenate([np.zeros((1, p)), np.eye(p)])
