"""Drawing one sealed case: rig, loads, withheld effects at a wanted strength, sensors and noise.

Everything is drawn from one generator, so a case is a function of its seed. A drawn effect has to act: its strength is searched
until the gap of the identification records is the wanted one, and the draw is thrown away where the judging
record then shows less than half or more than twice of that, or where one of two effects hides behind the other.
What the stated uncertainties of the nominal model explain is no gap and is thrown away too, since the right answer would be
"none"; so are a foreign effect and a pair of effects that a single catalogued one explains, since "unknown" and two names would
be wrong. A background makes its part of what is left when the nominal model is re-estimated, for the same reason.
Nothing else is thrown away for being hard to tell: how well a record can tell at all is computed beside the
case instead (`bench.discrepancy.blind.detectability`) and stands in the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.arrays import Array
from bench.discrepancy.blind.detectability import Lasting, detectability, lasting
from bench.discrepancy.blind.handed_over import (
    HANDED_OVER_SETTINGS,
    hand_over,
)
from bench.discrepancy.case.case import Case
from bench.discrepancy.truth.background import draw_background
from bench.discrepancy.truth.ground_truth import ROWS, WithheldEffect
from bench.discrepancy.truth.moreau_time_stepping import TrueMotion
from bench.discrepancy.truth.recipe import Drawn, Recipe, Shape
from bench.discrepancy.truth.rigs import Bench, BlindOptions, CasePlan, draw_bench, reach_of
from bench.discrepancy.truth.withheld_effects import RECIPES
from bench.errors import BenchError, ParameterError, SimulationError

KINDS = ("none", "single", "double", "foreign")


@dataclass(frozen=True)
class DrawingSettings:
    """Numbers of `bench.discrepancy.blind.drawing`."""

    bisections: int = 14
    """Halvings of the logarithm of a strength between e^-7 and e^3: to a tenth of a percent."""
    attempts: int = 200
    """Draws before the maker gives up; a handful is usual."""
    plans: int = 10_000
    """Draws of a plan before the maker says that there is none: the rarest kind of case is drawn every few hundred times."""
    persistence: int = 40
    """Draws of one plan: some ask for what cannot be, a stop that makes a gap of 4 % only, say."""
    close: tuple[float, float] = (0.85, 1.18)
    """Gap of the identification records over the wanted one; the search is made with coarse steps."""
    alike: tuple[float, float] = (0.5, 2.0)
    """Gap of the judging record over the wanted one."""
    hidden: float = 0.3
    """Least part of the wanted gap that each of two effects has to add to the other."""
    beyond: float = 4.0
    """An error of a nominal parameter is an effect from so many of its stated standard deviations on."""
    expected: float = 10.0
    """Expected log odds against the nominal model, re-estimated within its uncertainty, from which there is a gap; and those against
    the nearest single effect of the catalogue from which a foreign one is foreign to the records, and two effects are two."""


DRAWING_SETTINGS = DrawingSettings()
WRONG = {
    "single": ("log_odds_none",),
    "foreign": ("log_odds_rival",),
    "double": ("log_odds_one", "log_odds_rival"),
}
"""Odds by kind of case against what the right answer would be if they were small."""


def draw_case(name: str, rng: np.random.Generator, options: BlindOptions) -> tuple[Case, dict[str, Any]]:
    """Draw one case and its answer.

    Raises:
        ParameterError: None of many draws reached the wanted gap.
    """
    for attempt in range(DRAWING_SETTINGS.attempts):
        if attempt % DRAWING_SETTINGS.persistence == 0:
            plan = draw_plan(rng, options)
        try:
            made = _attempt(name, plan, rng, options)  # pyrefly: ignore[unbound-name]
        except SimulationError:  # a softening spring too strong for the load: drawn again like any other miss
            made = None
        if made is not None:
            case, answer = made
            answer["attempts"] = attempt + 1
            return case, answer
    raise ParameterError(
        f"case '{name}': none of {DRAWING_SETTINGS.attempts} draws reached its gap; widen the range of gaps"
    )


def draw_plan(rng: np.random.Generator, options: BlindOptions) -> CasePlan:
    """Draw the kind of a case, its rig, effects, sensors, gap and noise.

    Raises:
        ParameterError: The options allow none.
    """
    for _ in range(DRAWING_SETTINGS.plans):
        kind = "single" if options.leave_one_out else str(rng.choice(KINDS, p=options.shares))
        rig = str(rng.choice(["sdof", "damper", "joint"], p=options.rigs))
        pool = [
            r
            for r in RECIPES
            if rig in r.rigs
            and r.foreign == (kind == "foreign")
            and (not options.effects or r.name in options.effects)
        ]
        count = {"none": 0, "single": 1, "double": 2, "foreign": 1}[kind]
        if len(pool) < count:
            continue
        weights = np.array([r.weight for r in pool])
        picked = rng.choice(len(pool), size=count, replace=False, p=weights / weights.sum()) if count else []
        recipes = tuple(pool[int(i)] for i in picked)
        sets = [s for s in options.sensors if all(not r.sensors or s in r.sensors for r in recipes)]
        if not sets:
            continue
        places = tuple(
            ""
            if rig != "joint"
            else ("joint" if r.n_coordinates == 2 else str(rng.choice(["axial", "torsional"])))
            for r in recipes
        )
        if not _apart(recipes, places):
            continue
        commanded = any(r.site == "actuator" for r in recipes) or (rig == "sdof" and rng.random() < 0.1)
        return CasePlan(
            kind, rig, recipes, places, "" if rig == "damper" else str(rng.choice(sets)), commanded,
            float(np.exp(rng.uniform(*np.log(options.gap)))), float(np.exp(rng.uniform(*np.log(options.noise)))),
        )  # fmt: skip
    raise ParameterError(
        f"no case can be drawn from effects {', '.join(options.effects) or 'of every kind'} with shares {options.shares} (none, "
        f"single, double, foreign), rigs {options.rigs} and sensors {', '.join(options.sensors)}; allow more of them"
    )


def _apart(recipes: Sequence[Recipe], places: Sequence[str]) -> bool:
    """Whether effects can be told to be several.

    Two channels spoiled at once, or two errors of one number, are a calibration to be repeated, no diagnosis; and what holds
    another effect at the same place is itself, with other parameters.
    """
    here = {r.name: place for r, place in zip(recipes, places, strict=True)}
    return sum(r.site != "joint" for r in recipes) <= 1 and not any(
        here.get(name) == here[r.name] for r in recipes for name in r.holds
    )


def _attempt(
    name: str, plan: CasePlan, rng: np.random.Generator, options: BlindOptions
) -> tuple[Case, dict[str, Any]] | None:
    bench = draw_bench(plan, rng, options)
    bare = bench.responses((), quick=True)
    shapes = [r.draw(rng, reach_of(bench, w)) for r, w in zip(plan.recipes, plan.places, strict=True)]
    effects = _strengths(bench, shapes, bare[:-1], rng)
    if effects is None or any(_stated(plan.rig, e) for e in effects):
        return None
    coarse = bench.responses(effects, quick=True)
    if not _acts(bench, coarse, bare):
        return None
    runs = bench.run(effects)
    with_effects = [responses for responses, _ in runs]
    if not _acts(bench, with_effects, bare):
        return None
    # both from the coarse runs: the difference of two integrators is no gap
    gaps = bench.gaps(coarse[:-1], bare[:-1]), bench.gaps(coarse[-1:], bare[-1:])
    case, pure = hand_over(name, bench, with_effects, rng)
    background = None
    if options.background is not None:
        main = _main(pure, bench)
        if main.log_odds < DRAWING_SETTINGS.expected:
            return None
        background = draw_background(
            bench, bare[:-1], rng, options.background, DRAWING_SETTINGS.bisections, main=main.gap
        )
        if background is None:
            return None
        runs = bench.run([*effects, *background.acting])
        if not all(np.isfinite(samples).all() for responses, _ in runs for samples in responses.values()):
            return None
        case, _ = hand_over(name, bench, [responses for responses, _ in runs], rng, background)
    odds: dict[str, Any] = {}
    if effects and options.detectability:
        odds = detectability(pure, bench.truth.values, {e.recipe.name: e.where for e in effects})
    if any(odds.get(against, np.inf) < DRAWING_SETTINGS.expected for against in WRONG.get(plan.kind, ())):
        return None
    answer = _answer(bench, effects, runs, gaps, options) | {"detectability": odds}
    return case, answer | (background.answer() if background is not None else {})


def _main(pure: Case, bench: Bench) -> Lasting:
    """The main discrepancy, of which a background makes a part: what re-estimated parameters leave of that of the effect.

    What the stated uncertainties explain is no gap (see above), and a background larger than what is left would be the main thing.
    """
    if not bench.plan.recipes:
        return Lasting(bench.plan.gap, np.inf)
    try:
        left = lasting(pure, bench.truth.values)
    except (BenchError, np.linalg.LinAlgError):  # as of `detectability`: no reason to leave the case out
        return Lasting(bench.plan.gap, np.inf)
    return left._replace(gap=min(left.gap, bench.plan.gap))


def _stated(rig: str, placed: WithheldEffect) -> bool:
    """Whether an effect is an error of a nominal parameter that its stated uncertainty already allows for."""
    if placed.recipe.site != "inertia":
        return False
    spread = HANDED_OVER_SETTINGS.spreads[rig][
        "mass" if rig == "sdof" or placed.where == "axial" else "inertia"
    ]
    return abs(placed.drawn.values["relative_error"]) < DRAWING_SETTINGS.beyond * spread


def _acts(bench: Bench, real: Sequence[Mapping[str, Array]], bare: Sequence[Mapping[str, Array]]) -> bool:
    """Whether the records are finite and the gap is the wanted one on those for identification and alike on the other."""
    if not all(np.isfinite(samples).all() for r in real for samples in r.values()):
        return False
    if not bench.plan.recipes:
        return True
    found = max(bench.gaps(real[:-1], bare[:-1])) / bench.plan.gap
    judged = max(bench.gaps(real[-1:], bare[-1:])) / bench.plan.gap
    return (
        DRAWING_SETTINGS.close[0] < found < DRAWING_SETTINGS.close[1]
        and DRAWING_SETTINGS.alike[0] < judged < DRAWING_SETTINGS.alike[1]
    )


def _strengths(
    bench: Bench, shapes: Sequence[Shape], bare: list[dict[str, Array]], rng: np.random.Generator
) -> list[WithheldEffect] | None:
    """Effects at the strength that gives the wanted gap; None where they cannot reach it."""
    plan = bench.plan

    def placed(drawn: Sequence[Drawn]) -> list[WithheldEffect]:
        return [WithheldEffect(r, w, d) for r, w, d in zip(plan.recipes, plan.places, drawn, strict=True)]

    def gap(effects: Sequence[WithheldEffect]) -> float:
        return max(bench.gaps(bench.responses(effects, quick=True, judging=False), bare))

    def search(make: Callable[[float], Sequence[WithheldEffect]], wanted: float) -> float:
        low, high = -7.0, 3.0
        for _ in range(DRAWING_SETTINGS.bisections):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(make(np.exp(middle))) < wanted else (low, middle)
        return float(np.exp(0.5 * (low + high)))

    if len(shapes) < 2:
        strengths = [search(lambda a, s=s: placed([s(a)]), plan.gap) for s in shapes]
        return placed([s(a) for s, a in zip(shapes, strengths, strict=True)])
    single = [
        search(lambda a, i=i, s=s: [placed([s(a)] * len(shapes))[i]], plan.gap * rng.uniform(0.5, 0.9))
        for i, s in enumerate(shapes)
    ]
    common = search(lambda b: placed([s(b * a) for s, a in zip(shapes, single, strict=True)]), plan.gap)
    effects = placed([s(common * a) for s, a in zip(shapes, single, strict=True)])
    together = bench.responses(effects, quick=True, judging=False)
    for i in range(len(effects)):
        others = effects[:i] + effects[i + 1 :]
        if (
            max(bench.gaps(together, bench.responses(others, quick=True, judging=False)))
            < DRAWING_SETTINGS.hidden * plan.gap
        ):
            return None
    return effects


def _answer(
    bench: Bench,
    effects: Sequence[WithheldEffect],
    runs: Sequence[tuple[Mapping[str, Array], TrueMotion]],
    gaps: tuple[list[float], list[float]],
    options: BlindOptions,
) -> dict[str, Any]:
    plan = bench.plan
    regions = []
    for e in effects:
        if not e.drawn.region:
            continue
        row = ROWS[plan.rig][e.where][0]
        reach = float(max(np.abs(m.position @ row).max() for _, m in runs[:-1]))
        inside = [(max(a, -reach), min(b, reach)) for a, b in e.drawn.region if a < reach and b > -reach]
        if not inside:  # a rigid stop, which no sample of the motion is beyond
            continue
        regions.append(
            {
                "dof": e.where,
                "coordinate": "displacement",
                "reach": reach,
                "intervals": [list(i) for i in inside],
            }
        )
    return {
        "class": plan.kind,
        "rig": plan.rig,
        "effects": [
            {
                "name": e.recipe.name,
                "where": e.where,
                "parameters": [float(v) for v in e.drawn.values.values()],
                "names": list(e.drawn.values),
            }
            for e in effects
        ],
        "struck": [e.recipe.name for e in effects] if options.leave_one_out else [],
        "wanted_gap": plan.gap if effects else 0.0,
        "gap_nrmse_identification": gaps[0],
        "gap_nrmse_validation": gaps[1],
        "noise": plan.noise,
        "sensors": plan.sensors or "prescribed",
        "commanded": plan.commanded,
        "signals": list(bench.signals),
        "regions": regions,
        "true": dict(bench.truth.values),
    }
