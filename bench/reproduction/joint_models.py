"""The coupled joint's identified models, made once a process: the items of chapters 4 and 5 share them.

Records, excitations and what a laboratory sees of them are those of `bench.demo.joint`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

from bench.demo.joint import excitation, laboratory_view, training_records
from bench.identification.network import NetworkModel, fit_network
from bench.identification.polynomial import PolynomialModel, fit_polynomial
from bench.identification.restoring_force import JointData
from bench.recording import Recording, nmse
from bench.rig import simulate
from bench.rig.library import joint_rig

AXES = ("axial", "torsional")
LOADINGS = {"axial": (True, False), "torsional": (False, True), "both": (True, True)}
"""Which axes an excitation loads, by the name of the record."""


@dataclass(frozen=True)
class JointModelsSetup:
    """Numbers of `bench.reproduction.joint_models`."""

    hidden: int = 40
    unseen_seeds: Mapping[str, int] = field(
        default_factory=lambda: {"axial": 101, "torsional": 102, "both": 2006}
    )


SETUP = JointModelsSetup()


class Models(NamedTuple):
    """Models of the joint from the three training records, and how long each took to fit."""

    polynomial: PolynomialModel
    network: NetworkModel
    polynomial_seconds: float
    network_seconds: float


@cache
def training() -> dict[str, Recording]:
    """The three training records by loading."""
    return dict(zip(LOADINGS, training_records(), strict=True))


@cache
def unseen() -> dict[str, Recording]:
    """Records of the same loadings under excitations of other seeds."""
    return {
        name: simulate(joint_rig(), excitation(*loaded), rng=np.random.default_rng(SETUP.unseen_seeds[name]))
        for name, loaded in LOADINGS.items()
    }


def view(*records: Recording) -> JointData:
    """States and restoring forces as measured at body 1."""
    return laboratory_view(records, joint_rig())


def train_network(data: JointData, seed: int = SETUP.hidden) -> NetworkModel:
    """A network of 40 units."""
    return fit_network(data.states, data.forces, n_hidden=SETUP.hidden, rng=np.random.default_rng(seed))


@cache
def models() -> Models:
    """Polynomial of order 3 and network of 40 units, both fitted to all samples of the three records."""
    data = view(*training().values())
    start = time.perf_counter()
    polynomial = fit_polynomial(data.states, data.forces, orders=3)
    middle = time.perf_counter()
    network = train_network(data)
    return Models(polynomial, network, middle - start, time.perf_counter() - middle)


@cache
def total_degree_polynomial() -> PolynomialModel:
    """A polynomial of total degree 5, 126 coefficients a force: without the mixed terms of high degree of the full tensor.

    Those are what makes the tensor, which fits well, run away in closed loop once a state leaves its data.
    """
    data = view(*training().values())
    return fit_polynomial(data.states, data.forces, orders=5, kind="total", degree=5)


@cache
def held_at_edge() -> tuple[PolynomialModel, NetworkModel]:
    """Polynomial of order 3 and the network of `models`, both held at the edge of their data with a spring and a damper beyond."""
    data = view(*training().values())
    polynomial = fit_polynomial(data.states, data.forces, orders=3, bounded=True)
    return polynomial, models().network.bounded(data.forces)


def errors(model: PolynomialModel | NetworkModel, record: Recording) -> tuple[float | None, float | None]:
    """NMSE of the axial and the torsional force on the true states of a record [%]; None for an axis at rest."""
    data = view(record)
    predicted = model.predict(data.states)
    scores = [
        nmse(data.forces[:, i], predicted[:, i]) if np.ptp(data.states[:, i]) > 0.0 else None for i in (0, 1)
    ]
    return scores[0], scores[1]
