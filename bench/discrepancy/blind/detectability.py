"""How well records can tell an effect at all: expected log odds at the truth, and what re-estimated parameters leave of its gap,
from the records without their noise.

Half the chi-squared that a wrong explanation leaves in noise-free records, its parameters fitted, is the log odds by which
noisy ones are expected to refute it (up to the Occam factors, a few units). Two of them go into the answer of a
sealed case: against *none*, the nominal model re-estimated within its uncertainty, and against the nearest rival, the best
other single effect of the catalogue. A diagnosis cannot be right more often than these numbers let it, and the
scoring reports its bands.

The fits are those of the diagnosis, at noise-free data. Few rivals are fitted, each from one start: the odds against the nearest
rival are an upper bound, and a small value is certain while a large one is not.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bench.discrepancy.case.case import Case
from bench.errors import BenchError

if TYPE_CHECKING:
    from bench.discrepancy.fitting.map_fit import Fit
    from bench.discrepancy.fitting.starts import Point
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.model.structure import Structure


@dataclass(frozen=True)
class DetectabilitySettings:
    """Numbers of `bench.discrepancy.blind.detectability`."""

    rivals: int = 6
    rivals_coupled: int = 3
    """Effects that the screening likes best and that are fitted; fewer where an effect couples the degrees of freedom."""
    most: float = 1e9
    """Log odds beyond which nobody counts."""
    iterations: int = 8
    last: int = 25
    """Iterations of each, and of the best of them and of the nominal model."""


SETTINGS = DetectabilitySettings()


def detectability(pure: Case, true: Mapping[str, float], truth: Mapping[str, str]) -> dict[str, Any]:
    """Expected log odds of the truth against "none" and against its nearest rival.

    Args:
        pure: The case with its stated noise and next to none in the records.
        true: True parameters by name.
        truth: Places of the withheld effects by name.

    Returns:
        ``log_odds_none``, ``log_odds_rival`` and ``rival``, and for two effects ``log_odds_one``, against the better of them alone;
        infinite values are given as 1e9. Empty where the fits fail: a case is made of the truth, and what the diagnosis cannot do
        with it is no reason to leave it out.
    """
    try:
        return _odds_of(pure, true, truth)
    except (BenchError, np.linalg.LinAlgError):
        return {}


class Lasting(NamedTuple):
    """What the nominal model leaves once it is re-estimated within its stated uncertainty.

    Attributes:
        gap: NRMSE of the records for identification, of the judged coordinate where it is largest.
        log_odds: Expected log odds against that model.
    """

    gap: float
    log_odds: float


def lasting(pure: Case, true: Mapping[str, float]) -> Lasting:
    """What of the gap of a case is left once its nominal model is re-estimated: what an effect makes that no parameter can.

    Args:
        pure: The case with its stated noise and next to none in the records.
        true: True parameters by name.

    Raises:
        BenchError: The nominal model cannot be fitted.
    """
    from bench.discrepancy.likelihood.problem import Problem  # noqa: PLC0415
    from bench.discrepancy.model.rigs import structure_of  # noqa: PLC0415
    from bench.discrepancy.prediction.validation_discrepancy import errors_by_block  # noqa: PLC0415
    from bench.discrepancy.search.explanation import Explanation  # noqa: PLC0415

    structure = structure_of(pure)
    problem = Problem(pure, structure, pure.identification)
    nothing = _nothing(problem)
    predict = Explanation(((problem, nothing),)).predict
    power = errors_by_block(problem, pure.identification, predict, 1).sum(axis=1)
    return Lasting(float(np.sqrt(power.max())), 0.5 * (nothing.cost - _cost_of(problem, true)))


def _nothing(problem: Problem) -> Fit:
    """The nominal model, its parameters fitted."""
    from bench.discrepancy.fitting.map_fit import fit  # noqa: PLC0415

    return fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=SETTINGS.last)


def _cost_of(problem: Problem, true: Mapping[str, float]) -> float:
    """What the true parameters cost by the prior alone: noise-free records cost them nothing."""
    names = problem.structure.parameters
    away = [(true[name] - problem.nominal[i]) / problem.spread[i] for i, name in enumerate(names)]
    return float(np.sum(np.square(away)))


class _Group(NamedTuple):
    """Log odds of the truth within degrees of freedom that nothing else is coupled to.

    Attributes:
        none: Against the nominal model.
        rival: Against the nearest other single effect.
        name: Of that effect.
        alone: Against the better one of two withheld effects; against the nominal model where only one is withheld.
    """

    none: float
    rival: float
    name: str
    alone: float


def _odds_of(pure: Case, true: Mapping[str, float], truth: Mapping[str, str]) -> dict[str, Any]:
    # the diagnosis is imported where it is asked: a maker that was told to leave this out runs without it
    from bench.discrepancy.model.rigs import structure_of  # noqa: PLC0415

    structure = structure_of(pure)
    parts = [structure.restricted(group) for group in structure.groups()]
    if any(len(place.rows) > 1 for place in structure.places if place.name in truth.values()):
        parts = [structure]  # an effect that couples them
    held = [part for part in parts if {p.name for p in part.places} & set(truth.values())]
    groups = [_group(pure, part, true, truth) for part in held]
    none = sum(group.none for group in groups)
    # a single other effect explains one group, and leaves the others as they are
    nearest = min(groups, key=lambda group: group.rival - group.none)
    odds = {
        "log_odds_none": min(none, SETTINGS.most),
        "log_odds_rival": min(none - nearest.none + nearest.rival, SETTINGS.most),
        "rival": nearest.name,
    }
    if len(truth) > 1:
        odds["log_odds_one"] = min([SETTINGS.most, *(group.alone for group in groups)])
    return odds


def _group(pure: Case, structure: Structure, true: Mapping[str, float], truth: Mapping[str, str]) -> _Group:
    from bench.discrepancy.effects.catalogue import CATALOGUE  # noqa: PLC0415
    from bench.discrepancy.fitting.map_fit import fit  # noqa: PLC0415
    from bench.discrepancy.likelihood.problem import Problem  # noqa: PLC0415
    from bench.discrepancy.model.placements import placements  # noqa: PLC0415
    from bench.discrepancy.screening.screen import Screen  # noqa: PLC0415

    problem = Problem(pure, structure, pure.identification)
    cost, nothing = _cost_of(problem, true), _nothing(problem)
    own = {name for name, where in truth.items() if where in {p.name for p in structure.places}}
    coupling = len(structure.groups()) > 1
    screen = Screen(problem, placements(pure, structure, CATALOGUE))
    ground = screen.ground()
    starts: dict[tuple[str, str, str], Any] = {}
    for point in screen.ranked(None, ground):
        starts.setdefault(point.placed.key, point)

    def best_of(points: Iterable[Point]) -> Fit:
        fits = [
            fit(
                problem,
                (p.placed,),
                start=screen.starts(p, ground),
                iterations=SETTINGS.iterations,
            )
            for p in points
        ]
        best = min(fits, key=lambda f: f.cost, default=nothing)
        return fit(problem, best.hypothesis, start=best.vector, iterations=SETTINGS.last)

    others = (p for p in starts.values() if p.placed.effect.name not in own)
    rival = best_of(islice(others, SETTINGS.rivals_coupled if coupling else SETTINGS.rivals))
    none = 0.5 * (nothing.cost - cost)
    alone = none
    if len(own) > 1:
        mine = best_of(p for p in starts.values() if p.placed.effect.name in own)
        alone = min(none, 0.5 * (mine.cost - cost))
    return _Group(
        none,
        min(0.5 * (rival.cost - cost), none),
        rival.hypothesis[0].effect.name if rival.hypothesis else "none",
        alone,
    )
