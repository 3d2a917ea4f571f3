"""Global sparse regression (pysindy) as a diagnosis: the equations of motion from smoothed states, named by their largest term.

It gets the states that the diagnosis itself smooths out of the records, a library that holds the static effects of the
catalogue, and more thresholds than people try, of which a BIC with the number of independent samples takes one. What it
cannot have is a hidden state, so neither hysteresis nor relaxation, nor actuators and sensors beyond a gain.

References:
    S. L. Brunton, J. L. Proctor, J. N. Kutz, PNAS 113 (2016) 3932-3937 (sequentially thresholded least squares).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pysindy

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.model.structure import Place, Structure

Column = Callable[[Array, Array, Array, float | Array], Array]
"""Positions, velocities (…, n_dof), loads (…, n_loads) and time (…) to a column of the library (…)."""
CLEARANCES = tuple(round(0.1 * i, 1) for i in range(1, 10))
"""Clearances and stops of the library, as parts of the largest displacement."""
POWERS = (0.3, 0.5, 0.7)
THRESHOLDS = tuple(float(x) for x in np.geomspace(0.3, 0.001, 16))
"""Smallest part of the acceleration that a term of the library has to make."""
RIDGE = 1e-4
"""Dead-spaces of neighbouring clearances are nearly the same column; a larger ridge spreads a force over them."""
SIGNIFICANT = 3.0
"""Uncertainties by which a nominal coefficient may be off before it is named."""
DIVERGED = 1e6


@dataclass(frozen=True)
class Term:
    """A term of the library.

    Attributes:
        effect: Name of the effect that it stands for; empty for those of the nominal model.
        where: Place.
        column: Its values.
    """

    effect: str
    where: str
    column: Column


def _nominal(structure: Structure) -> list[Term]:
    terms = []
    for i in range(len(structure.dofs)):
        terms.append(Term("", "", lambda q, v, u, t, i=i: q[..., i]))
        terms.append(Term("", "", lambda q, v, u, t, i=i: v[..., i]))
    terms += [Term("", "", lambda q, v, u, t, j=j: u[..., j]) for j in range(len(structure.loads))]
    return terms


def _of_place(place: Place, largest: float, duration: float) -> list[Term]:
    row = place.rows[0]

    def term(effect: str, column: Callable[[Array, Array], Array]) -> Term:
        return Term(effect, place.name, lambda q, v, u, t: column(q @ row, v @ row))

    terms = [
        term("coulomb_friction", lambda x, w: np.sign(w)),
        term("load_dependent_friction", lambda x, w: np.abs(x) * np.sign(w)),
        term("quadratic_stiffness", lambda x, w: x * x),
        term("cubic_stiffness", lambda x, w: x * x * x),
        term("quadratic_damping", lambda x, w: w * np.abs(w)),
        term("quadratic_damping", lambda x, w: w * w * w),
        term("force_offset", lambda x, w: 0.0 * x + 1.0),
        Term("stiffness_drift", place.name, lambda q, v, u, t: (q @ row) * t / duration),
    ]
    terms += [term("power_law_damping", lambda x, w, n=n: np.sign(w) * np.abs(w) ** n) for n in POWERS]
    for part in CLEARANCES:
        d = part * largest
        terms.append(term("gap", lambda x, w, d=d: np.sign(x) * np.maximum(np.abs(x) - d, 0.0)))
        terms.append(term("one_sided_stop", lambda x, w, d=d: np.maximum(x - d, 0.0)))
        terms.append(term("one_sided_stop", lambda x, w, d=d: np.minimum(x + d, 0.0)))
    return terms


def _of_couple(one: Place, other: Place, largest: float) -> list[Term]:
    """Terms of one coordinate's force that another one has a part in."""
    a, b = one.rows[0], other.rows[0]
    terms = []
    for part in CLEARANCES:
        d = part * largest
        terms.append(
            Term(
                "gap_coupling", "joint", lambda q, v, u, t, d=d: (v @ a) * np.maximum(np.abs(q @ b) - d, 0.0)
            )
        )
    return terms


@dataclass(frozen=True)
class Equations:
    """Sparse equations of motion.

    Attributes:
        terms: The library.
        coefficients: Accelerations by term (n_dof, n_terms).
        sizes: Root-mean-square of each term's part of each acceleration, over that acceleration's (n_dof, n_terms).
    """

    terms: list[Term]
    coefficients: Array
    sizes: Array

    def run(self, structure: Structure, record: CaseRecord) -> Array:
        """Free run from rest (n, n_channels) by classical Runge-Kutta steps over the samples."""
        kept = np.flatnonzero(np.any(self.coefficients != 0.0, axis=0))
        columns, weights = [self.terms[k].column for k in kept], self.coefficients[:, kept]
        loads = np.column_stack([record.values[name] for name in structure.loads])
        middle = 0.5 * (loads[:-1] + loads[1:])
        n, h, start = len(structure.dofs), record.step, record.start

        def rate(t: float, y: Array, u: Array) -> Array:
            q, v = y[:n], y[n:]
            return np.concatenate([v, weights @ np.array([column(q, v, u, t) for column in columns])])

        y, out = np.zeros(2 * n), np.full((len(record), 3 * n), np.nan)
        for k in range(len(record)):
            t = start + k * h
            first = rate(t, y, loads[k])
            out[k] = np.concatenate([y, first[n:]])
            if k + 1 == len(record) or not np.all(np.abs(y) < DIVERGED):
                break
            second = rate(t + 0.5 * h, y + 0.5 * h * first, middle[k])
            third = rate(t + 0.5 * h, y + 0.5 * h * second, middle[k])
            fourth = rate(t + h, y + h * third, loads[k + 1])
            y = y + h / 6.0 * (first + 2.0 * (second + third) + fourth)
        return np.column_stack([out[:, o.order * n : (o.order + 1) * n] @ o.row for o in structure.observers])


def _library(problem: Problem) -> list[Term]:
    structure = problem.structure
    terms = _nominal(structure)
    single = [place for place in structure.places if len(place.rows) == 1]
    largest = {place.name: problem.scales(place).position for place in single}
    duration = len(problem.records[0]) * problem.records[0].step
    for place in single:
        terms += _of_place(place, largest[place.name], duration)
    for one in single:
        for other in single:
            if one is not other:
                terms += _of_couple(one, other, largest[other.name])
    return terms


def regress(problem: Problem) -> Equations:
    """Sparse equations at the threshold with the least BIC."""
    structure, n_dof = problem.structure, len(problem.structure.dofs)
    terms = _library(problem)
    parts, rates = [], []
    for i, record in enumerate(problem.records):
        motion = problem.motion(i)
        loads = np.column_stack([record.values[name] for name in structure.loads])
        parts.append([t.column(motion.position, motion.velocity, loads, record.time) for t in terms])
        rates.append(motion.acceleration)
    columns = np.hstack([np.array(part) for part in parts]).T
    reached = np.any(columns != 0.0, axis=0)  # the motion is not symmetric: some stops are never met
    terms, columns = [t for t, met in zip(terms, reached, strict=True) if met], columns[:, reached]
    scale = np.sqrt(np.mean(np.vstack(rates) ** 2, axis=0))
    target = np.vstack(rates) / scale
    # the same least squares for any threshold, of as many rows as terms
    basis, triangle = np.linalg.qr(columns)
    projected = basis.T @ target
    independent = sum(2 * data.n_bins for data in problem.data)
    best: tuple[float, Array] | None = None
    for threshold in THRESHOLDS:
        # columns are normalised to one, so coefficients are parts of a target whose norm is the root of the count
        regression = pysindy.STLSQ(
            threshold=threshold * np.sqrt(len(target)), alpha=RIDGE, normalize_columns=True
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that a threshold is too high to leave anything
            coefficients = np.asarray(regression.fit(triangle, projected).coef_, np.float64)
        error = np.mean((target - columns @ coefficients.T) ** 2)
        score = independent * n_dof * np.log(error) + np.count_nonzero(coefficients) * np.log(independent)
        if best is None or score < best[0]:
            best = (float(score), coefficients)
    assert best is not None
    sizes = np.abs(best[1]) * np.sqrt(np.mean(columns**2, axis=0))
    return Equations(terms, best[1] * scale[:, None], sizes)


def _largest(structure: Structure, equations: Equations) -> tuple[str, str] | None:
    """Name and place of the largest term beyond the nominal model."""
    best, found = 0.0, None
    for group in structure.groups():
        for i in group:
            for k, term in enumerate(equations.terms):
                # a position of a degree of freedom that the nominal model does not couple with this one
                crossed = k < 2 * len(structure.dofs) and k % 2 == 0 and k // 2 not in group
                if equations.sizes[i, k] > best and (term.effect or crossed):
                    best = float(equations.sizes[i, k])
                    found = (term.effect, term.where) if term.effect else ("cross_stiffness", "joint")
    return found


def _nominal_name(problem: Problem, equations: Equations) -> tuple[str, str] | None:
    """Effect of a nominal coefficient that is further off than its uncertainty lets it be; one coordinate only."""
    if len(problem.structure.dofs) != 1:
        return None
    table = dict(
        zip(problem.structure.parameters, zip(problem.nominal, problem.spread, strict=True), strict=True)
    )
    mass, mass_std = table["mass"]
    k, c, load = equations.coefficients[0, :3]
    commanded = problem.case.channel(problem.structure.loads[0]).role == "command"
    found = [
        (
            abs(load * mass - 1.0) / (mass_std / mass or 1e-3),
            "force_gain_error" if commanded else "mass_error",
        )
    ]
    for name, value, effect in (("stiffness", k, "stiffness_error"), ("damping", c, "damping_error")):
        if name in table and table[name][0] > 0.0:
            nominal, std = table[name]
            measured = -value / load if load else np.inf
            found.append((abs(measured - nominal) / (std or 1e-3 * nominal), effect))
    worst = max(found)
    return (worst[1], "") if worst[0] > SIGNIFICANT else None


def diagnose(case: Case) -> tuple[tuple[str, str] | None, Callable[[CaseRecord], Mapping[str, Array]]]:
    """Name and place of the largest term beyond the nominal ones, None without any, and the free run of a record."""
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    equations = regress(problem)
    found = _largest(structure, equations) or _nominal_name(problem, equations)

    def predict(record: CaseRecord) -> Mapping[str, Array]:
        return dict(zip(structure.channels, equations.run(structure, record).T, strict=True))

    return found, predict
