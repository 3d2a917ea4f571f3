"""C4: the joint identified without knowing the mass of the body that it is measured at (Tasbihgoo 2006, section 4.5)."""

from __future__ import annotations

import numpy as np

from bench.demo.joint import laboratory_view
from bench.figures import bar_table
from bench.identification.network import NetworkModel, fit_network
from bench.identification.polynomial import PolynomialModel, fit_polynomial
from bench.progress import ShowProgress
from bench.reproduction import joint_models
from bench.reproduction.item import Item, Picture
from bench.reproduction.verdict import Row, RowVerdict, fact_row, value_row
from bench.rig.library import inertia_of, joint_rig

SOURCE = "p. 96, sentence (section 4.5)"


def _both(model: PolynomialModel | NetworkModel) -> dict[str, float]:
    """NMSE of the forces on the true states of the unseen records, by record and axis [%]."""
    return {
        f"{name}, {axis}": score
        for name, record in joint_models.unseen().items()
        for axis, score in zip(joint_models.AXES, joint_models.errors(model, record), strict=True)
        if score is not None
    }


def _rows(
    known: dict[str, dict[str, float]], unknown: dict[str, dict[str, float]], masses: dict[str, np.ndarray]
) -> tuple[Row, ...]:
    rows: list[Row] = []
    for kind in ("polynomial", "network"):
        before, after = max(known[kind].values()), max(unknown[kind].values())
        rows.append(
            value_row(
                f"{kind}: worst unseen NMSE without the mass over that with it",
                "1",
                "knowledge of the mass matrix is not crucial",
                after / before,
                high=1.5,
                source=SOURCE,
                reason="half as much again is not crucial; no number is printed",
                verdict=None if after / before <= 1.5 or after > 5.0 else RowVerdict.SHAPE,
                why=f"{after:.2g} % instead of {before:.2g} %: still a good fit, by much, but not as good: two more inputs",
            )
        )
    true = np.array([inertia_of(joint_rig(), name) for name in ("axial_1", "torsional_1")])
    for kind, mass in masses.items():
        error = 100.0 * float(np.max(np.abs(np.diag(mass) / true - 1.0)))
        rows.append(
            fact_row(
                f"{kind}: mass and inertia of the body found",
                f"within {error:.2g} % of the rig's",
                error < 5.0,
                printed="mass and inertia added to the unknown parameters" if kind == "polynomial" else "",
                source=SOURCE if kind == "polynomial" else "",
                tolerance="within 5 %",
                reason="inertia is most of the applied force: an error of it by more would be seen in the force",
                why="what the model cannot follow of the force is in part in phase with the acceleration",
            )
        )
    return tuple(rows)


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    progress("models that know the mass", 0.05)
    given = joint_models.models()
    data = laboratory_view([*joint_models.training().values()], joint_rig(), mass_known=False)
    progress("polynomial", 0.4)
    polynomial = fit_polynomial(data.states, data.forces, orders=3, accelerations=data.accelerations)
    progress("network", 0.5)
    network = fit_network(
        data.states,
        data.forces,
        n_hidden=joint_models.SETUP.hidden,
        accelerations=data.accelerations,
        rng=np.random.default_rng(joint_models.SETUP.hidden),
    )
    known = {"polynomial": _both(given.polynomial), "network": _both(given.network)}
    unknown = {"polynomial": _both(polynomial), "network": _both(network)}
    masses = {
        kind: mass
        for kind, mass in (("polynomial", polynomial.mass), ("network", network.mass))
        if mass is not None
    }
    scores = {f"{kind}, mass known": values for kind, values in known.items()} | {
        f"{kind}, mass unknown": values for kind, values in unknown.items()
    }
    text = (
        "The records and models of C2, with the mass and inertia of body 1 unknown: what is fitted are the applied forces less "
        "mounts, the accelerations are further inputs of the network and, with the mass matrix as their coefficients, "
        "further terms of the polynomial. The joint is the model at zero acceleration."
    )
    return Item(
        text,
        _rows(known, unknown, masses),
        (
            Picture(
                "errors",
                "NMSE on unseen records, mass known and unknown.",
                bar_table(scores, limit=5.0, limit_label="good fit"),
            ),
        ),
        "number of units as in C2",
    )
