"""Regions outside which no force is missing, told by free runs rather than by a map.

A map of the missing force sees what rises above the noise sample by sample, and cannot tell a force within a window from one of
opposite sign outside it, as a stiffness a little off makes of it. Here the force is free: straight lines between the corners of a
grid over the displacement or the velocity, each with a part in proportion to the other one of them and a part in proportion to its
magnitude, as the impulses of a stop have. It drives the linear structure along the measured motion, as in the screening, nominal
parameters re-estimated; so its coefficients follow from one linear problem, and the evidence of a force that is limited to a part
of the grid needs no further run. All parts are weighed against no limit at all.

References:
    D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447 (evidence of linear models).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.model.structure import Place
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.candidates import along
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import LocalisationSettings


@dataclass(frozen=True)
class BoundedForceSettings:
    """Numbers of `bench.discrepancy.localisation.bounded_force`."""

    cells: int = 24
    """Cells that the reach of a coordinate is cut into."""


SETTINGS = BoundedForceSettings()
COORDINATES = ("displacement", "velocity")
SHAPES = 3
"""Coefficients of a cell: of the force itself, and of the parts in proportion to the other coordinate and to its magnitude."""


class _Part(NamedTuple):
    """A part of the grid that a force may be limited to.

    Attributes:
        cells: Numbers of its cells.
        intervals: First cell and the one after the last of each of its intervals.
    """

    cells: NDArray[np.int64]
    intervals: tuple[tuple[int, int], ...]

    @property
    def coefficients(self) -> NDArray[np.int64]:
        """Numbers of the coefficients of its cells."""
        return np.concatenate([self.cells + shape * SETTINGS.cells for shape in range(SHAPES)])


class _Free(NamedTuple):
    """A free force over one coordinate of a place.

    Attributes:
        coordinate: "displacement" or "velocity".
        reach: Largest value of the coordinate.
        forces: (n_samples, SHAPES CELLS) of unit coefficients along the motion of all records.
        gram: (SHAPES CELLS, SHAPES CELLS) products of its whitened responses.
        seen: (SHAPES CELLS,) their products with what the nominal model leaves.
        coefficients: (SHAPES CELLS,) those of the unlimited force.
        left: Chi-squared that the unlimited force leaves.
    """

    coordinate: str
    reach: float
    forces: Array
    gram: Array
    seen: Array
    coefficients: Array
    left: float

    @property
    def cells(self) -> NDArray[np.int64]:
        """Cell of every sample (n_samples,)."""
        return np.asarray(np.argmax(self.forces[:, : SETTINGS.cells], axis=1), dtype=np.int64)

    def extent(self, part: _Part, ending: float) -> float:
        """Share of the samples in a part, and a little for each of its ends within the motion."""
        share = float(np.isin(self.cells, part.cells).mean())
        return share + ending * sum((first > 0) + (end < SETTINGS.cells) for first, end in part.intervals)


def limited_regions(nominal: Explanation, best: Explanation) -> dict[str, tuple[dict[str, Any], ...]]:
    """Regions of a missing force that acts in a part of the state space only, by name of its place.

    Args:
        nominal: The explanation without effects, in one part for each group of coupled degrees of freedom.
        best: What comes nearest; its free run tells the motion where it is down to the noise, whatever force it takes for that.

    Returns:
        For each place with such a force its regions by decreasing share: limits of "displacement" or "velocity", "share" of its
        square, mean "force".
    """
    out = {}
    for problem, _ in nominal.parts:
        screen = Screen(problem, [])
        for own, fitted in best.parts:
            if own is problem:
                screen = along(screen, fitted)
        ground = screen.ground()
        for place in problem.structure.places:
            if len(place.rows) == 1:
                found = _regions(place, screen, ground)
                if found:
                    out[place.name] = found
    return out


def _regions(place: Place, screen: Screen, ground: Ground) -> tuple[dict[str, Any], ...]:
    """Regions of the force that is missing at a place; none where nothing is, or where it has no limits."""
    settings = screen.problem.settings.localisation
    motions = [screen.problem.motion(i) for i in range(len(screen.problem.records))]
    states = [np.column_stack([m.position @ place.rows[0], m.velocity @ place.rows[0]]) for m in motions]
    free = [_free(place, states, over, screen, ground) for over in range(len(COORDINATES))]
    # what not even the better one explains is no less noise to the other
    excess = max(1.0, min(f.left for f in free) / len(ground.residual))
    parts = _parts()
    everything = _Part(np.arange(SETTINGS.cells), ((0, SETTINGS.cells),))
    whole = [_evidence(f, everything, excess, settings=screen.problem.settings.localisation) for f in free]
    limited = [
        np.array(
            [_evidence(f, part, excess, settings=screen.problem.settings.localisation) for part in parts]
        )
        for f in free
    ]
    weight = float(np.logaddexp.reduce(np.concatenate(limited))) - math.log(2 * len(parts))
    if weight < max(0.0, float(np.logaddexp.reduce(whole)) - math.log(2.0)) + settings.region_sure:
        return ()
    over = int(np.argmax([own.max() for own in limited]))
    best = limited[over].max()
    alike = [
        part
        for part, own in zip(parts, limited[over], strict=True)
        if own > best * (1.0 - settings.region_imprecise)
    ]
    return _described(
        free[over], min(alike, key=lambda part: free[over].extent(part, settings.region_ending))
    )


def _free(place: Place, states: list[Array], over: int, screen: Screen, ground: Ground) -> _Free:
    """The free force over the displacement (0) or the velocity (1) of a place."""
    reach, other = (float(max(np.abs(s[:, i]).max() for s in states)) or 1.0 for i in (over, 1 - over))
    per_record = []
    for state in states:
        at = np.asarray(0.5 * SETTINGS.cells * (state[:, over] / reach + 1.0) - 0.5, dtype=np.float64)
        hats = np.clip(1.0 - np.abs(at[:, None] - np.arange(SETTINGS.cells)), 0.0, None)
        # beyond the middle of the outermost cells the force stays what it is there
        hats[at < 0.0, 0], hats[at > SETTINGS.cells - 1.0, -1] = 1.0, 1.0
        along = state[:, [1 - over]] / other
        per_record.append(np.hstack([hats, hats * along, hats * np.abs(along)]))
    row = place.rows[0]

    def response(k: int) -> Array:
        return screen.response(lambda i: -np.outer(per_record[i][:, k], row))

    columns = np.column_stack(
        in_threads(lambda k: ground.project(response(k)), range(SHAPES * SETTINGS.cells))
    )
    alone = ground.left
    gram, seen = columns.T @ columns, columns.T @ alone
    best = np.asarray(np.linalg.lstsq(gram, seen, rcond=1e-9)[0], dtype=np.float64)
    left = float(alone @ alone - 2.0 * seen @ best + best @ gram @ best)
    return _Free(COORDINATES[over], reach, np.vstack(per_record), gram, seen, best, left)


def _parts() -> list[_Part]:
    """All intervals of the grid, and all grids without an interval within."""
    cells, out = np.arange(SETTINGS.cells), []
    for i in range(SETTINGS.cells):
        for j in range(i + 1, SETTINGS.cells + 1):
            if j - i < SETTINGS.cells:
                out.append(_Part(cells[i:j], ((i, j),)))
            if i > 0 and j < SETTINGS.cells:
                out.append(_Part(np.delete(cells, np.arange(i, j)), ((0, i), (j, SETTINGS.cells))))
    return out


def _evidence(free: _Free, part: _Part, excess: float, *, settings: LocalisationSettings) -> float:
    """Log evidence of a force limited to a part, against no force; `excess`: power of the residuals, one for noise."""
    own = part.coefficients
    powers, axes = np.linalg.eigh(free.gram[np.ix_(own, own)])
    powers = np.maximum(powers, 0.0) / excess
    squares = (axes.T @ free.seen[own]) ** 2 / excess**2
    size = float(np.sqrt(np.mean(free.coefficients**2))) or 1.0
    return max(
        float(0.5 * np.sum(squares / (powers + (size * s) ** -2)) - 0.5 * np.sum(np.log1p(powers * (size * s) ** 2)))
        for s in settings.region_sizes
    )  # fmt: skip


def _described(free: _Free, part: _Part) -> tuple[dict[str, Any], ...]:
    """The intervals of a part with the force in them, by decreasing share."""
    own = part.coefficients
    coefficients = np.zeros(SHAPES * SETTINGS.cells)
    coefficients[own] = np.linalg.lstsq(free.gram[np.ix_(own, own)], free.seen[own], rcond=1e-9)[0]
    force = free.forces @ coefficients
    at = free.cells
    total = float(np.sum(force[np.isin(at, part.cells)] ** 2)) or 1.0
    out: list[dict[str, Any]] = []
    for first, end in part.intervals:
        inside = (at >= first) & (at < end)
        limits = tuple((2.0 * edge / SETTINGS.cells - 1.0) * free.reach for edge in (first, end))
        share = float(np.sum(force[inside] ** 2)) / total
        mean = float(np.mean(force[inside])) if inside.any() else 0.0
        out.append({free.coordinate: limits, "share": share, "force": mean})
    return tuple(sorted(out, key=lambda region: -region["share"]))
