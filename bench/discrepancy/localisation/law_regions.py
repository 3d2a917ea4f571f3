"""Where a named effect acts: the part of the state space in which its fitted law exerts a force.

A map of the missing force resolves cells, and only where the force rises above the noise of the cell. Once an effect is named,
its law tells more: a stop of 0.2 mm of engagement begins at one displacement, known as well as its parameters are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.screening.motion_response import force_along_motion
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import LocalisationSettings


def acting_regions(best: Explanation) -> dict[str, tuple[dict[str, Any], ...]]:
    """Regions of the effects of an explanation that act in a part of the state space only, by name of their place.

    Args:
        best: An explanation that the records bear out.

    Returns:
        For each place its regions by decreasing share: limits by coordinate ("displacement", "velocity"; those that the effect
        depends on), "share" of the squared force of that effect, mean "force", and the "effect".
    """
    out: dict[str, list[dict[str, Any]]] = {}
    for problem, fitted in best.parts:
        _, etas = problem.split(fitted.hypothesis, fitted.vector)
        for placed, eta in zip(fitted.hypothesis, etas, strict=True):
            if (
                placed.effect.site == "joint"
                and len(placed.place.rows) == 1
                and placed.effect.law is not None
            ):
                out.setdefault(placed.place.name, []).extend(_regions(problem, placed, eta))
    return {name: tuple(sorted(found, key=lambda r: -r["share"])) for name, found in out.items() if found}


def _regions(simulator: Simulator, placed: Placed, eta: Array) -> list[dict[str, Any]]:
    """Regions of one effect along the measured motion; none where it acts everywhere."""
    row = placed.place.rows[0]
    states, forces = [], []
    for i in range(len(simulator.records)):
        motion = simulator.motion(i)
        states.append(np.column_stack([motion.position @ row, motion.velocity @ row]))
        forces.append(force_along_motion(simulator, placed, eta, i) @ row / (row @ row))
    state, force = np.concatenate(states), np.concatenate(forces)
    acts = np.abs(force) > simulator.settings.localisation.acts * np.abs(force).max()
    total = float(np.sum(force**2))
    limits = {
        name: _intervals(state[:, i], acts, settings=simulator.settings.localisation)
        for i, name in enumerate(("displacement", "velocity"))
    }
    limited = {name: intervals for name, intervals in limits.items() if intervals}
    out = []
    # each interval of the first coordinate that limits the effect, within the hull of what it does along the other
    first = next(iter(limited), "")
    for low, high in limited.get(first, ()):
        own = state[:, list(limits).index(first)]
        inside = acts & (own >= low) & (own <= high)
        region: dict[str, Any] = {first: (low, high)}
        for other in limited:
            if other != first:
                along = state[inside, list(limits).index(other)]
                region[other] = (float(along.min()), float(along.max()))
        share = float(np.sum(force[inside] ** 2)) / total
        out.append(
            region | {"share": share, "force": float(np.mean(force[inside])), "effect": placed.effect.name}
        )
    return out


def _intervals(
    coordinate: Array, acts: np.ndarray, *, settings: LocalisationSettings
) -> list[tuple[float, float]]:
    """Intervals of a coordinate, out of those between the largest values either way, in which something acts; empty where that is
    all of the visited ones."""
    reach = float(np.abs(coordinate).max()) or 1.0
    cell = np.clip(
        ((coordinate / reach + 1.0) * 0.5 * settings.law_cells).astype(int), 0, settings.law_cells - 1
    )
    visited = np.unique(cell)
    active = np.isin(visited, np.unique(cell[acts]))
    if active.all():
        return []
    out = []
    for run in np.split(visited, np.flatnonzero(np.diff(active)) + 1):
        inside = acts & (cell >= run[0]) & (cell <= run[-1])
        if inside.any():
            # where the motion turns back the force does not end
            low = -reach if run[0] == visited[0] else float(coordinate[inside].min())
            high = reach if run[-1] == visited[-1] else float(coordinate[inside].max())
            out.append((low, high))
    return out
