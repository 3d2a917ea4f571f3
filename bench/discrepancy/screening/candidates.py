"""Candidates: which effects are worth a fit beside a hypothesis, and from which starts."""

from __future__ import annotations

from collections.abc import Sequence

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import consistent, near, sticks
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.settings import DiagnosisSettings


def _within_priors(fitted: Fit, simulator: Simulator) -> bool:
    """Whether a hypothesis explains the records without nominal parameters far off their values."""
    return (
        consistent(fitted)
        and fitted.cost - fitted.chi2 < len(simulator.nominal) + fitted.settings.screening.worth_a_fit / 2
    )


def tells_motion(base: Fit, simulator: Simulator) -> bool:
    """Whether one more effect is best screened along the free run of a base, since that tells the motion better than the records.

    Where friction sticks it is not, unless all is explained: a small force more moves the stops, which no linear response does.
    The nominal model alone is asked whether it explains the records within its priors.
    """
    if not base.hypothesis:
        return _within_priors(base, simulator)
    return consistent(base) or (near(base) and not sticks(base))


def about(screen: Screen, base: Fit, *, explained: bool) -> Screen:
    """The screening that tells what a base lacks: about its free run where that follows the motion, else about the measured one."""
    spoilt = any(placed.effect.site == "sensor" for placed in base.hypothesis)
    return screen.beside(base, simulated=explained) if spoilt or explained else screen


def along(screen: Screen, fitted: Fit) -> Screen:
    """A screening along the free run of an explanation that follows the motion: it tells it better than the records.

    Not where a sensor is part of it; what the sensor told instead would be no residual of another force.
    """
    spoilt = any(placed.effect.site == "sensor" for placed in fitted.hypothesis)
    told = fitted.hypothesis and tells_motion(fitted, screen.problem) and not spoilt
    return screen.beside(fitted, simulated=True) if told else screen


def refined(screen: Screen, ground: Ground, points: Sequence[Point]) -> list[Point]:
    """Refine the leading grid points of the leading effects along the measured motion; by decreasing gain.

    Args:
        screen: Screening.
        ground: What the base leaves.
        points: Solved grid points by decreasing gain.
    """
    settings = screen.problem.settings.screening
    chosen: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        if point.gain < 0.5 * settings.short * points[0].gain:
            break
        if point.placed.key not in chosen and len(chosen) == settings.refined_effects:
            continue
        starts = chosen.setdefault(point.placed.key, [])
        if len(starts) < settings.refined_starts and all(
            _apart(point, other) > settings.apart for other in starts
        ):
            starts.append(point)
    tasks = [point for starts in chosen.values() for point in starts]
    return sorted(in_threads(lambda point: screen.refine(point, ground), tasks), key=lambda p: -p.gain)


def _apart(point: Point, other: Point) -> float:
    """Distance of two starts of an effect in the parameters that have a grid."""
    return max(
        (
            abs(a - b) / p.std
            for a, b, p in zip(point.eta, other.eta, point.placed.effect.parameters, strict=True)
            if p.grid
        ),
        default=0.0,
    )


def leading(
    points: Sequence[Point], count: int, least: float, starts: int = 2, *, settings: DiagnosisSettings
) -> list[Point]:
    """Starts of the `count` effects of largest gain: the best of each, and further ones that are nearly as good."""
    grouped: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        if point.gain < least:
            break
        if point.placed.key not in grouped and len(grouped) == count:
            continue
        own = grouped.setdefault(point.placed.key, [])
        if not own or (
            len(own) < starts
            and point.gain > settings.screening.nearly * own[0].gain
            and all(_apart(point, other) > settings.search.same for other in own)
        ):
            own.append(point)
    return [point for own in grouped.values() for point in own]


def passed_over(
    solved: Sequence[Point], chosen: Sequence[Point], count: int, least: float, *, settings: DiagnosisSettings
) -> list[Point]:
    """Starts of forces with nothing but their size to be found that are not among the chosen ones.

    They are cheap to fit, and never to be lost to a law of seven parameters because their gain along a badly known motion was small.
    """
    begun = {point.placed.key for point in chosen}
    simplest = [p for p in solved if _plain(p.placed.effect) and p.placed.key not in begun]
    return leading(simplest, count, least, starts=1, settings=settings)


def _plain(effect: Effect) -> bool:
    return effect.site == "joint" and effect.n_coordinates == 1 and len(effect.parameters) == 1
