"""Explanations: hypotheses for all degrees of freedom together, and how well they predict.

A rig may fall apart into groups of degrees of freedom that its linear structure does not couple: the axial and the torsional
motion of a joint. Each group is searched on its own; effects that couple groups are searched on the whole, when
the groups alone do not reach the noise. Chi-squared and evidence add over groups, so all explanations can be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bench.discrepancy.attribute import QUICK, STALLED, Search, attribute, consistent, placements, posterior
from bench.discrepancy.case import Case, CaseRecord
from bench.discrepancy.effect import Effect
from bench.discrepancy.fit import Fit, fit
from bench.discrepancy.problem import Array, Hypothesis, Placed, Problem, band_bins, whitened
from bench.discrepancy.screen import Screen
from bench.discrepancy.structure import Structure, structure_of

HELPFUL = 0.3
"""A catalogued explanation that leaves less than this part of the excess is kept under a closure; others only disturb it."""
KEPT = 12
"""Hypotheses of a group that are combined with those of other groups."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A hypothesis for the whole rig, fitted.

    Attributes:
        parts: One (problem, fit) for every group of degrees of freedom.
    """

    parts: tuple[tuple[Problem, Fit], ...]

    @property
    def hypothesis(self) -> Hypothesis:
        """All effects."""
        return tuple(placed for _, fitted in self.parts for placed in fitted.hypothesis)

    @property
    def log_posterior(self) -> float:
        """Log posterior up to a constant common to all explanations of a case."""
        return sum(posterior(fitted) for _, fitted in self.parts)

    @property
    def consistent(self) -> bool:
        """Whether every group's residuals are down to the noise."""
        return all(consistent(fitted) for _, fitted in self.parts)

    @property
    def reduced(self) -> float:
        """Chi-squared of all groups over its expectation."""
        return sum(f.chi2 for _, f in self.parts) / sum(f.n_residuals for _, f in self.parts)

    def predict(self, record: CaseRecord) -> dict[str, Array]:
        """Free run of a record: response channel to samples (n,)."""
        out: dict[str, Array] = {}
        for problem, fitted in self.parts:
            samples = problem.simulate(fitted.hypothesis, fitted.vector, record)
            out.update({name: samples[:, c] for c, name in enumerate(problem.structure.channels)})
        return out

    def reduced_on(self, record: CaseRecord) -> float:
        """Chi-squared over its expectation on a record that the fit has not seen."""
        chi2 = count = 0.0
        for problem, fitted in self.parts:
            data = problem.prepare(record, problem.split(fitted.hypothesis, fitted.vector)[0])
            residual = whitened(data.responses - problem.simulate(fitted.hypothesis, fitted.vector, record), data)
            chi2 += float(residual @ residual)
            count += len(residual)
        return chi2 / count


def explain(
    case: Case, catalogue: Sequence[Effect], *, most: int = 3, progress: Callable[[str], None] = lambda text: None
) -> list[Explanation]:
    """Search the explanations of a case; by decreasing posterior.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        most: Largest number of effects in a group.
        progress: Called with a line of text at every stage.
    """
    structure = structure_of(case)
    groups = structure.groups()
    if len(groups) == 1:
        problem = Problem(case, structure, case.identification)
        search = attribute(problem, placements(case, structure, catalogue), most=most, progress=progress)
        found = [Explanation(((problem, fitted),)) for fitted in search.ranked()]
        return found if problem.noise_stated else _parsimonious(found)
    bins = _common_bins(case, structure)
    searches = []
    for group in groups:
        part = structure.restricted(group)
        problem = Problem(case, part, case.identification, bins)
        progress(f"degrees of freedom {', '.join(part.dofs)}")
        searches.append(attribute(problem, placements(case, part, catalogue), most=2, progress=progress))
    found = _combined(searches)
    if not found[0].consistent:
        progress("effects that couple the degrees of freedom")
        whole = Problem(case, structure, case.identification, bins)
        found += [Explanation(((whole, fitted),)) for fitted in _coupled(whole, searches, catalogue, most)]
        found.sort(key=lambda e: -e.log_posterior)
    return found


def _coupled(whole: Problem, searches: Sequence[Search], catalogue: Sequence[Effect], most: int) -> list[Fit]:
    """Fit the coupling effects, alone and with the best single effects of the groups."""
    structure = whole.structure
    coupling = [p for p in placements(whole.case, structure, catalogue) if p.effect.n_coordinates > 1]
    screen = Screen(whole, coupling)
    kept = Search(whole)
    for placed in coupling:
        points = [point for point in screen.ranked() if point.placed.key == placed.key]
        if points:
            start = np.concatenate([np.zeros(len(whole.nominal)), points[0].eta])
            kept.add(fit(whole, (placed,), start=start))
    companions = _shortlist(searches, structure)
    for _ in range(1, most):
        if not kept.fits or consistent(kept.ranked()[0]):
            break
        base = kept.ranked()[0]
        own = {placed.key for placed in base.hypothesis}
        trials = []
        for placed, eta in companions:
            if placed.key not in own:
                start = np.concatenate([base.vector, eta])
                trials.append(fit(whole, (*base.hypothesis, placed), start=start, iterations=QUICK))
        trials.sort(key=lambda f: -f.log_evidence)
        for trial in trials[:2]:
            kept.add(fit(whole, trial.hypothesis, start=trial.vector))
        if kept.ranked()[0] is base:
            break
    return kept.ranked()


def _parsimonious(found: list[Explanation]) -> list[Explanation]:
    """Put first the smallest explanation that one more effect would not improve much.

    Where the noise is not stated, chi-squared has no absolute scale and residuals of a measured component are mostly
    model error, far from independent: differences in evidence then say little about one more effect.
    """
    chosen = found[0]
    sizes = sorted({len(e.hypothesis) for e in found})
    for size in sizes:
        best = min((e for e in found if len(e.hypothesis) == size), key=lambda e: e.reduced)
        larger = [e.reduced for e in found if len(e.hypothesis) == size + 1]
        chosen = best
        if not larger or min(larger) > STALLED * best.reduced:
            break
    return [chosen, *(e for e in found if e is not chosen)]


def _common_bins(case: Case, structure: Structure) -> dict[str, int]:
    whole = Problem(case, structure, case.identification)
    bins = {d.record.name: d.n_bins for d in whole.data}
    for record in case.validation:
        responses = np.column_stack([record.values[name] for name in structure.channels])
        bins[record.name] = band_bins(responses, whole.noise)
    return bins


def _combined(searches: Sequence[Search]) -> list[Explanation]:
    ranked = [
        [(s.problem, fitted) for fitted in dict.fromkeys((*s.ranked()[:KEPT], s.ranked(0)[0]))] for s in searches
    ]
    found = [Explanation(tuple(parts)) for parts in product(*ranked)]
    return sorted(found, key=lambda e: -e.log_posterior)


def _shortlist(searches: Sequence[Search], structure: Structure, count: int = 3) -> list[tuple[Placed, Array]]:
    """Single effects that did best in their group, as effects on the whole structure with their fitted parameters."""
    places = {place.name: place for place in structure.places}
    chosen = []
    for search in searches:
        joint = [f for f in search.ranked(1) if f.hypothesis[0].effect.site == "joint"]
        for fitted in joint[:count]:
            placed = fitted.hypothesis[0]
            _, etas = search.problem.split(fitted.hypothesis, fitted.vector)
            chosen.append((Placed(placed.effect, places[placed.place.name], placed.target), etas[0]))
    return chosen


def close(best: Explanation, closures: Sequence[Effect]) -> tuple[Explanation, str]:
    """Add nonparametric closures to an explanation while they pay.

    Args:
        best: The best catalogued explanation.
        closures: Free models of a missing force.

    Returns:
        The closed explanation, and the names of the closures used.
    """
    parts, used = [], []
    for problem, fitted in best.parts:
        current = fitted
        if not consistent(fitted):
            candidates = placements(problem.case, problem.structure, closures)
            screen = Screen(problem, candidates)
            current = fit(problem, (), start=np.zeros(len(problem.nominal)))
            if fitted.reduced - 1.0 < HELPFUL * (current.reduced - 1.0):
                current = fitted
            for _ in candidates:
                points = screen.ranked(current)
                if not points:
                    break
                start = np.concatenate([current.vector, points[0].eta])
                closed = fit(problem, (*current.hypothesis, points[0].placed), start=start, iterations=12)
                if closed.log_evidence <= current.log_evidence:
                    break
                current = closed
                used.append(points[0].placed.effect.name)
                if consistent(current):
                    break
        parts.append((problem, current))
    return Explanation(tuple(parts)), " + ".join(dict.fromkeys(used))
