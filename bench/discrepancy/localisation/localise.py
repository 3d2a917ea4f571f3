"""Where the discrepancy lies: channels, degrees of freedom, frequency bands, times, and regions of the state space.

Two residuals are split. That of the free run of the nominal model, its parameters re-estimated, is whitened; what its
power has beyond one is excess, and is split by channel, by frequency band and by time. That of the equations is the force
missing along the measured motion (`force_smoother`); it is split by displacement, velocity, travel since the last reversal, in
and out of contact, band and time (`state_map`). Shares of a split add up to one, and in each the false discovery rate is
controlled. Channels that contradict one another whatever the force (`parity_relations`) make it a fault of a sensor.

No split knows which effect is named later. The regions are those of the force map, unless an effect that the records bear out
acts in a part of the state space only: its law then tells them better than any map (`law_regions`). So does a free force, where the
effect is unknown and the records tell that it has limits (`bounded_force`).

References:
    Y. Benjamini, Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995) 289-300.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from bench.discrepancy.fitting.goodness_of_fit import near
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.bounded_force import limited_regions
from bench.discrepancy.localisation.law_regions import acting_regions
from bench.discrepancy.localisation.parity_relations import Contradiction, contradictions
from bench.discrepancy.localisation.regions import Region
from bench.discrepancy.localisation.residual_splits import excess_of, holding, residual_splits
from bench.discrepancy.localisation.state_map import StateMap, state_maps
from bench.discrepancy.localisation.state_splits import force_splits
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.verdict import Location, Split

STATES = ("displacement", "velocity")
"""Coordinates of a region of the state space."""


class Whereabouts(NamedTuple):
    """Where the discrepancy lies.

    Attributes:
        locations: Channels with an excess, by decreasing share.
        splits: Shares by channel, band, time and state.
        maps: Missing force over the state space, for every place with one coordinate.
        contradictions: Pairs of channels held against each other.
        acting: Regions of the named effects that act in a part of the state space only, or of an unknown one that does, by place;
            see `acting_regions` and `limited_regions`.
    """

    locations: tuple[Location, ...]
    splits: tuple[Split, ...]
    maps: tuple[StateMap, ...]
    contradictions: tuple[Contradiction, ...]
    acting: Mapping[str, tuple[dict[str, Any], ...]]


def locate(
    problem: Problem,
    nominal: Explanation,
    best: Explanation,
    *,
    borne_out: bool,
    unknown: bool,
) -> Whereabouts:
    """Locate the residuals of the nominal model.

    Args:
        problem: Records and structure on all degrees of freedom.
        nominal: The explanation without effects, its parameters re-estimated.
        best: The best explanation; where it is down to the noise its nominal parameters serve for the force map.
        borne_out: Whether the records bear out the forces of `best`, so that these tell where they act.
        unknown: Whether the discrepancy is due to something unknown.
    """
    names = problem.structure.channels
    excess = excess_of(problem, nominal)
    found = contradictions(problem)
    known = known_parameters(best)
    maps = state_maps(problem, problem.records, known=known)
    acting: Mapping[str, tuple[dict[str, Any], ...]] = {}
    if borne_out and best.noise_stated and all(near(fitted) for _, fitted in best.parts):
        acting = acting_regions(best)
    if unknown and not acting:
        acting = limited_regions(nominal, best)
    total = sum(max(e.chi2 - e.count, 0.0) for e in excess.values())
    p_values = [float(stats.chi2.sf(e.chi2, e.count)) for e in excess.values()]
    adjusted = dict(zip(excess, stats.false_discovery_control(p_values), strict=True)) if excess else {}
    locations = []
    for name, own in excess.items():
        share = max(own.chi2 - own.count, 0.0) / total if total > 0.0 else 0.0
        if share <= 0.0:
            continue
        observer = problem.structure.observers[names.index(name)]
        touched = [m for m in maps if np.any(m.place.rows[0] * observer.row != 0)]
        kind = _kind(name, found)
        regions = _regions_at(() if kind == "sensor" else touched, touched, acting)
        locations.append(
            Location(
                channel=name,
                dof=problem.structure.dofs[int(np.argmax(np.abs(observer.row)))],
                share=share,
                band_hz=holding(own.frequency, own.power - 2.0, settings=problem.settings.localisation),
                time_s=holding(own.time, own.signal**2 - 1.0, settings=problem.settings.localisation),
                state_region={k: v for k, v in regions[0].items() if k in STATES} if regions else {},
                p_value=float(adjusted[name]),
                kind=kind,
                regions=regions,
            )
        )
    return Whereabouts(
        tuple(sorted(locations, key=lambda location: -location.share)),
        (*residual_splits(problem, excess), *force_splits(problem, problem.records, maps)),
        maps,
        found,
        acting,
    )


def _regions_at(
    trusted: Sequence[StateMap], touched: Sequence[StateMap], acting: Mapping[str, tuple[dict[str, Any], ...]]
) -> tuple[dict[str, Any], ...]:
    """Regions at the places of the maps that a channel touches: of the effects that are limited to a region, or else of the
    trusted maps; what a faulty sensor tells of a force is not."""
    limited = tuple(region for m in touched for region in acting.get(m.place.name, ()))
    return limited or tuple(
        {**box(r), "share": r.share, "force": r.force} for m in trusted for r in m.regions
    )


def box(region: Region) -> dict[str, tuple[float, float]]:
    """The limits of a region by coordinate; a coordinate that it does not depend on is left out."""
    limits = {"displacement": region.displacement, "velocity": region.velocity}
    return {name: limit for name, limit in limits.items() if limit is not None}


def known_parameters(best: Explanation) -> dict[str, float] | None:
    """Nominal parameters as the best explanation has them; None where it does not reach the noise and so proves nothing."""
    if not best.consistent or not best.noise_stated:
        return None
    out: dict[str, float] = {}
    for part, fitted in best.parts:
        values = part.nominal + part.spread * fitted.vector[: len(part.nominal)]
        out.update(dict(zip(part.structure.parameters, values, strict=True)))
    return out


def _kind(channel: str, found: tuple[Contradiction, ...]) -> str:
    own = [c for c in found if channel in c.channels]
    if not own:
        return "undetermined"
    if any(c.found and c.suspect in {"", channel} for c in own):
        return "sensor"
    return "force"


def left_by(problem: Problem, explanation: Explanation) -> dict[str, Any] | None:
    """Channel, band and interval that hold most of what an explanation leaves beyond noise; None where it leaves no more.

    Args:
        problem: Records and structure on all degrees of freedom.
        explanation: An explanation.
    """
    found = excess_of(problem, explanation)
    beyond = {name: e.chi2 - e.count for name, e in found.items()}
    if not beyond or max(beyond.values()) <= 0.0:
        return None
    name = max(beyond, key=lambda n: beyond[n])
    own = found[name]
    return {
        "channel": name,
        "band_hz": holding(own.frequency, own.power - 2.0, settings=problem.settings.localisation),
        "time_s": holding(own.time, own.signal**2 - 1.0, settings=problem.settings.localisation),
    }
