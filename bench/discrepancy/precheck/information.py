"""What the records can tell of nominal parameters and effects: Fisher information about the nominal model.

With the responses whitened, a nominal parameter changes them by a column a sigma of it; what all of them leave of its prior width is the
diagonal of ``(J'J + I)^-1``. An effect at the size that would matter changes them by a further column, of which the parameters imitate
what they can within their priors; the square of what remains is the chi-squared by which it will show.

References:
    S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, ch. 3 (Fisher information).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.effect import FreeParameter
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.precheck.settings import CheckSettings

Identifiability = Literal["identifiable", "weak", "not identifiable"]
WORDS: tuple[Identifiability, ...] = get_args(Identifiability)
"""What is said of a parameter or an effect, the best first."""


@dataclass(frozen=True)
class InformationSettings:
    """Numbers of `bench.discrepancy.precheck.information`."""

    step: float = 0.1
    """Step of the differences, in sigmas of a parameter: curvature is left out, and rounding is far."""
    secants: int = 8
    """Most steps towards an amplitude of a stated size: most effects are nearly a power of it and need two."""
    near_enough: float = 0.1
    """Part of the stated size at which they end."""
    starts: int = 6
    """Points of a grid that are tried for one that changes anything."""
    near: float = 0.5
    """Part of the stated size that an amplitude has to come to, and over which it must not be as far, to stand for it."""
    imitated: float = 0.9
    """Part of an effect's change beyond which nominal parameters that make it as well are told of."""


SETTINGS = InformationSettings()


class Told(NamedTuple):
    """How well the records tell something.

    Attributes:
        name: The parameter or effect.
        where: Place of an effect.
        word: In a word.
        figure: Posterior over prior width of a parameter; square root of the chi-squared by which an effect shows, in sigmas.
        text: In words.
        imitated: Part of an effect's change that nominal parameters make as well.
    """

    name: str
    where: str
    word: Identifiability
    figure: float
    text: str
    imitated: float = 0.0

    @property
    def imitable(self) -> bool:
        """Whether nominal parameters could stand in for an effect."""
        return self.imitated > SETTINGS.imitated


def shortened(case: Case, seconds: float) -> Case:
    """The case with the beginnings of its identification records."""

    def cut(record: CaseRecord) -> CaseRecord:
        n = max(round(seconds / record.step), 200)
        values = {name: samples[:n] for name, samples in record.values.items()}
        return replace(record, values=values, periodic=record.periodic and n >= len(record))

    return replace(case, identification=tuple(cut(record) for record in case.identification))


def parameter_columns(problem: Problem, record: CaseRecord, predicted: Array) -> list[Array]:
    """Changes (n, n_channels) of the predicted responses by a sigma of each uncertain parameter."""
    out = []
    for p in np.flatnonzero(problem.spread > 0.0):
        moved = np.zeros(len(problem.nominal))
        moved[p] = SETTINGS.step
        out.append((problem.simulate((), moved, record) - predicted) / SETTINGS.step)
    return out


def parameters_told(problem: Problem, settings: CheckSettings) -> tuple[list[Told], Array]:
    """How well the records tell each uncertain nominal parameter, and their whitened columns (n, n_parameters)."""
    rest = problem.residual((), np.zeros(len(problem.nominal)))
    uncertain = [int(p) for p in np.flatnonzero(problem.spread > 0.0)]
    columns = []
    for p in uncertain:
        moved = np.zeros(len(problem.nominal))
        moved[p] = SETTINGS.step
        column = (problem.residual((), moved) - rest) / SETTINGS.step
        columns.append(column if np.shape(column) == rest.shape else np.zeros_like(rest))
    if not columns:
        return [], np.zeros((len(rest), 0))
    J = np.column_stack(columns)
    cover = np.linalg.inv(J.T @ J + np.eye(J.shape[1]))
    found = []
    for k, p in enumerate(uncertain[: len(problem.structure.parameters)]):
        if p >= len(problem.structure.parameters):
            continue
        width = float(np.sqrt(cover[k, k]))
        found.append(
            graded_parameter(problem.structure.parameters[p], width, float(problem.spread[p]), settings)
        )
    return found, J


def effects_told(
    case: Case, problem: Problem, parameters: Array, settings: CheckSettings, only: Collection[str] = ()
) -> list[Told]:
    """How well the records tell each effect of the catalogue, or some of them, at the size that would matter."""
    known = [e for e in CATALOGUE if e.site != "record" and e.variant == ""]
    placed = [
        p
        for p in placements(case, problem.structure, known)
        if not p.source and not p.effect.rare and (not only or p.effect.name in only)
    ]
    rest = problem.residual((), np.zeros(len(problem.nominal)))
    gram = parameters.T @ parameters + np.eye(parameters.shape[1])
    inner = np.asarray(np.linalg.inv(gram), dtype=np.float64)

    def told(one: Placed) -> Told:
        sized = at_size(problem, one, settings.matters, settings)
        where = one.place.site or one.target
        if sized is None:
            return out_of_reach(one.effect.name, where, settings)
        column = problem.residual((one,), sized) - rest
        if np.shape(column) != rest.shape or not np.isfinite(column).all():
            return Told(
                one.effect.name, where, "weak", 0.0, "drives the nominal model out of bounds at that size"
            )
        return graded_effect(one.effect.name, where, column, parameters, inner, settings)

    return best_of(in_threads(told, placed))


def graded_parameter(name: str, width: float, spread: float, settings: CheckSettings) -> Told:
    """How well the records tell a nominal parameter.

    Args:
        name: The parameter.
        width: Posterior over prior width.
        spread: Its stated uncertainty.
        settings: When something counts.
    """
    word: Identifiability = (
        "identifiable"
        if width <= settings.identifiable
        else "weak"
        if width <= settings.weak
        else "not identifiable"
    )
    sigma = spread * width
    text = {
        "identifiable": f"known to ± {sigma:.3g}",
        "weak": f"± {sigma:.3g} instead of ± {spread:.3g}: excite it more, or for longer",
        "not identifiable": "these records say nothing of it: its stated uncertainty stays; leave it, or excite what it acts on",
    }[word]
    return Told(name, "", word, width, text)


def graded_effect(
    name: str, where: str, column: Array, parameters: Array, inner: Array, settings: CheckSettings
) -> Told:
    """How well the records tell an effect at the size that would matter.

    Args:
        name: The effect.
        where: Its place.
        column: Change (n,) of the whitened residuals by it.
        parameters: Changes (n, n_parameters) by a sigma of each nominal parameter.
        inner: ``(J'J + I)^-1`` of these.
        settings: When something counts.
    """
    along = parameters.T @ column
    left = float(column @ column - along @ inner @ along)
    imitated = 1.0 - left / max(float(column @ column), 1e-300)
    figure = math.sqrt(max(left, 0.0))
    word: Identifiability = (
        "identifiable"
        if left >= settings.certain
        else "weak"
        if left >= settings.hint
        else "not identifiable"
    )
    text = f"{figure:.3g} sigmas at {100 * settings.matters:.0f} % of a response"
    if imitated > SETTINGS.imitated:
        text += f"; nominal parameters imitate {100 * imitated:.0f} % of it"
    return Told(name, where, word, figure, text, imitated)


def out_of_reach(name: str, where: str, settings: CheckSettings) -> Told:
    """What is told of an effect that no amplitude of its prior makes large enough."""
    text = f"reaches {100 * settings.matters:.0f} % of no response within these motions: larger or slower ones would show it"
    return Told(name, where, "not identifiable", 0.0, text)


def best_of(found: Sequence[Told]) -> list[Told]:
    """The best told of the targets of each effect and place."""
    best: dict[tuple[str, str], Told] = {}
    for one in found:
        key = (one.name, one.where)
        if key not in best or one.figure > best[key].figure:
            best[key] = one
    return list(best.values())


def at_size(problem: Problem, placed: Placed, size: float, settings: CheckSettings) -> Array | None:
    """The vector of an effect whose amplitude changes a response by a part of its rms; None where it reaches none."""
    eta = sized(
        placed.effect.grid(), placed.effect.parameters[0], size, lambda x: _change(problem, placed, x), settings
    )  # fmt: skip
    return None if eta is None else np.concatenate([np.zeros(len(problem.nominal)), eta])


def sized(
    points: Sequence[Array],
    first: FreeParameter,
    size: float,
    change: Callable[[Array], float | None],
    settings: CheckSettings,
) -> Array | None:
    """Parameters whose amplitude changes a response by a part of its rms; None where none within its prior does.

    The change is taken as a power of the amplitude, one at first: a force grows with it, a saturation shrinks.

    Args:
        points: Parameters to start from, the amplitude first; the middle one is tried first.
        first: The amplitude.
        size: The part.
        change: Parameters to the part by which they change a response; None where the run diverged.
        settings: Within how many standard deviations of its prior the amplitude is looked for.
    """
    low, high = first.mean - settings.reach * first.std, first.mean + settings.reach * first.std
    low, high = max(low, first.bounds[0]), min(high, first.bounds[1])
    eta, now = _moving(points, first, change)
    power, shorter = 1.0, 1.0
    for _ in range(SETTINGS.secants):
        if now is None or now <= 0.0:
            return None
        if abs(now / size - 1.0) < SETTINGS.near_enough:
            break
        step = shorter * math.log(size / now) / power
        wanted = eta[0] * math.exp(step) if first.signed else eta[0] + step
        tried = eta.copy()
        tried[0] = min(max(wanted, low), high)
        then = change(tried)
        if then is None or then <= 0.0:  # beyond where it changes anything
            shorter *= 0.5
            continue
        made = math.log(tried[0] / eta[0]) if first.signed else tried[0] - eta[0]
        if abs(made) > 1e-9:
            found = math.log(then / now) / made
            power = math.copysign(min(max(abs(found), 0.2), 5.0), found)
        eta, now = tried, then
    return None if now is None or not SETTINGS.near < now / size < 1.0 / SETTINGS.near else eta


def _moving(
    points: Sequence[Array], first: FreeParameter, change: Callable[[Array], float | None]
) -> tuple[Array, float | None]:
    """The first of some points, the middle one foremost, that changes anything, and by how much."""
    middle = len(points) // 2
    order = [middle, *(k for k in range(len(points)) if k != middle)][: SETTINGS.starts]
    for k in order:
        eta = points[k].copy()
        if first.signed and eta[0] == 0.0:
            eta[0] = first.std
        now = change(eta)
        if now is not None and now > 0.0:
            return eta, now
    return points[middle].copy(), None


def _change(problem: Problem, placed: Placed, eta: Array) -> float | None:
    """Largest change of a response over its rms, over all records; None where the run diverged."""
    vector = np.concatenate([np.zeros(len(problem.nominal)), eta])
    most = 0.0
    for record in problem.records:
        with_it = problem.simulate((placed,), vector, record)
        without = problem.simulate((), np.zeros(len(problem.nominal)), record)
        if not np.isfinite(with_it).all():
            return None
        size = np.maximum(np.sqrt(np.mean(without**2, axis=0)), 1e-300)
        most = max(most, float(np.max(np.sqrt(np.mean((with_it - without) ** 2, axis=0)) / size)))
    return most
