"""What explanations leave of the records, and what the judging records say of them: whether they pay, harm, or are preferred."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.prediction.validation_discrepancy import (
    DIVERGED_GAP,
    errors_by_block,
    noise_floors,
    nominal_prediction,
)
from bench.discrepancy.search.explain import Explanation


class Discrepancies:
    """NRMSE of explanations, on the judged coordinate where the nominal model is farthest off; kept by explanation.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom.
        read: Channels that are judged besides: what is added to the reading of a sensor shows nowhere else.
    """

    def __init__(self, case: Case, problem: Problem, read: Collection[str] = ()) -> None:
        self.case, self.problem, self.read = case, problem, read
        self._floor = noise_floors(problem, case.validation, read)
        self._own_floor = noise_floors(problem, case.identification, read)
        self._kept: dict[tuple[Explanation, bool], Array] = {}

    @cached_property
    def as_stated(self) -> Array:
        """NRMSE (n_coordinates,) of the nominal model with its parameters as stated, on the judging records."""
        stated = nominal_prediction(self.problem)
        errors = errors_by_block(self.problem, self.case.validation, stated, 1, self.read)
        return np.minimum(np.sqrt(errors.sum(axis=1)), DIVERGED_GAP)

    def of(self, explanation: Explanation, *, judging: bool) -> Array:
        """NRMSE (n_coordinates,) of an explanation, on the judging records or on those for identification."""
        errors = self._errors(explanation, judging=judging)
        return np.minimum(np.sqrt(errors.sum(axis=1)), DIVERGED_GAP)

    def _errors(self, explanation: Explanation, *, judging: bool) -> Array:
        key = explanation, judging
        if key not in self._kept:
            records = self.case.validation if judging else self.case.identification
            blocks = self.problem.settings.judgement.held_out.blocks
            self._kept[key] = errors_by_block(self.problem, records, explanation.predict, blocks, self.read)
        return self._kept[key]

    def closed(self, explanation: Explanation, without: Explanation, nothing: Explanation) -> float:
        """Part of the discrepancy of `nothing`, on the records for identification, that goes with what one has and the other lacks."""
        before, left, right = (self.of(e, judging=False) for e in (nothing, without, explanation))
        return float(np.max((left - right) / np.maximum(before, 1e-300)))

    def beside(self, explanation: Explanation, without: Explanation) -> tuple[float, float]:
        """What one leaves that lacks an effect, and the part of its power that is left with it, on the records for identification.

        Noise is taken off both; of the coordinate where the former, an NRMSE, is largest.
        """
        lacking, left = (
            np.sqrt(np.maximum(self.of(e, judging=False) ** 2 - self._own_floor**2, 0.0))
            for e in (without, explanation)
        )
        widest = int(np.argmax(lacking))
        return float(lacking[widest]), float((left[widest] / max(lacking[widest], 1e-300)) ** 2)

    def pays(
        self, explanation: Explanation, nothing: Explanation, part: float, believed: Explanation | None = None
    ) -> bool:
        """Whether an explanation leaves at most a part of the judging records' discrepancy, beyond noise, on some coordinate and no
        more than all of it on any.

        What shrinks is the discrepancy of the nominal model, its parameters re-estimated as far as is believed or as stated: without
        what is missing, to re-estimate them may make it worse, and where it does, that is no harm of what is named. No harm is done
        to what the parameters leave wherever they go.

        Args:
            explanation: It.
            nothing: The nominal model, its parameters re-estimated.
            part: Largest part that may be left.
            believed: The same, its parameters moved no further than is believed; `nothing` where None.
        """
        before, after = self._judged(nothing, explanation)
        nearest = np.minimum(self.of(believed or nothing, judging=True), self.as_stated)
        shrinks = self._beyond(after) <= part * self._beyond(_at_rest(nearest))
        return bool(np.any(shrinks) and self._harm(before, after, explanation) <= 1.0)

    def harm(self, explanation: Explanation, rest: Explanation) -> float:
        """By what factor, beyond what is no change, an explanation leaves more of the judging records than a part of it does.

        Of the coordinate where that is most; at most one where both leave nothing but noise.
        """
        return self._harm(*self._judged(rest, explanation), explanation)

    def _harm(self, before: Array, after: Array, explanation: Explanation) -> float:
        settings = explanation.settings.judgement
        bar = np.maximum(before, settings.about_noise * self._floor) * settings.unchanged
        return float(np.max(np.where(after < DIVERGED_GAP, after / np.maximum(bar, 1e-300), np.inf)))

    def left(self, explanation: Explanation, rest: Explanation) -> float:
        """Part of the power of the judging records' discrepancy, beyond noise, that an explanation leaves beside a part of it."""
        return self.part(explanation, rest)[1]

    def part(self, explanation: Explanation, rest: Explanation) -> tuple[float, float]:
        """What an explanation closes that a part of it does not: its size, an NRMSE, and the part of the power that is left.

        Of the judging records, beyond noise, on the coordinate where it closes most: what is left on others, by other causes, says
        nothing against it. Of a nominal model that is worse than no motion at all, the part is that of the response.
        """
        before, after = self._judged(rest, explanation)
        before = np.minimum(before, self.as_stated)
        before, after = self._beyond(_at_rest(before)), self._beyond(after)
        closed = before**2 - after**2
        here = int(np.argmax(closed))
        left = min((after[here] / max(before[here], 1e-300)) ** 2, 1.0)
        return float(np.sqrt(max(closed[here], 0.0))), float(left)

    def beyond_noise(self, explanation: Explanation) -> float:
        """Largest NRMSE of an explanation on the judging records, the noise taken off."""
        return float(np.max(self._beyond(self.of(explanation, judging=True))))

    def prefers(self, rival: Explanation, explanation: Explanation) -> bool:
        """Whether the judging records prefer a rival of other names: it leaves less beyond noise where an explanation leaves most, and
        that is not noise alone."""
        names, others = ({(p.effect.name, p.place.name) for p in e.hypothesis} for e in (rival, explanation))
        if not names or names == others:
            return False
        settings = rival.settings.judgement
        theirs, own = (self._beyond(x) for x in self._judged(rival, explanation))
        widest = int(np.argmax(own))
        noise = self._beyond(settings.about_noise * settings.unchanged * self._floor)
        return bool(max(theirs[widest] * settings.unchanged, noise[widest]) < own[widest])

    def _judged(self, nothing: Explanation, explanation: Explanation) -> tuple[Array, Array]:
        return self.of(nothing, judging=True), self.of(explanation, judging=True)

    def _beyond(self, found: Array) -> Array:
        return np.sqrt(np.maximum(found**2 - self._floor**2, 0.0))


def _at_rest(found: Array) -> Array:
    """NRMSE of a prediction, or of no motion at all where that is nearer."""
    return np.minimum(found, 1.0)
