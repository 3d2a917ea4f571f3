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

from bench.discrepancy.attribute import Search, attribute, consistent, placements, posterior
from bench.discrepancy.case import Case, CaseRecord
from bench.discrepancy.effect import Effect
from bench.discrepancy.fit import Fit
from bench.discrepancy.problem import Array, Hypothesis, Placed, Problem, band_bins, whitened
from bench.discrepancy.structure import Structure, structure_of

KEPT = 12
"""Hypotheses of a group that are combined with those of other groups."""


@dataclass(frozen=True)
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
        return [Explanation(((problem, fitted),)) for fitted in search.ranked()]
    bins = _common_bins(case, structure)
    searches = []
    for group in groups:
        part = structure.restricted(group)
        problem = Problem(case, part, case.identification, bins)
        progress(f"degrees of freedom {', '.join(part.dofs)}")
        searches.append(attribute(problem, placements(case, part, catalogue), most=2, progress=progress))
    found = _combined(searches)
    coupling = [p for p in placements(case, structure, catalogue) if p.effect.n_coordinates > 1]
    if coupling and not found[0].consistent:
        progress("effects that couple the degrees of freedom")
        whole = Problem(case, structure, case.identification, bins)
        chosen = coupling + _shortlist(searches, structure)
        search = attribute(whole, chosen, most=most, progress=progress)
        found += [Explanation(((whole, fitted),)) for fitted in search.ranked()]
        found.sort(key=lambda e: -e.log_posterior)
    return found


def _common_bins(case: Case, structure: Structure) -> dict[str, int]:
    whole = Problem(case, structure, case.identification)
    bins = {d.record.name: d.n_bins for d in whole.data}
    for record in case.validation:
        responses = np.column_stack([record.values[name] for name in structure.channels])
        bins[record.name] = band_bins(responses, whole.noise)
    return bins


def _combined(searches: Sequence[Search]) -> list[Explanation]:
    ranked = [[(s.problem, fitted) for fitted in s.ranked()[:KEPT]] for s in searches]
    found = [Explanation(tuple(parts)) for parts in product(*ranked)]
    return sorted(found, key=lambda e: -e.log_posterior)


def _shortlist(searches: Sequence[Search], structure: Structure, count: int = 8) -> list[Placed]:
    """Effects on one group that did best there, as effects on the whole structure."""
    places = {place.name: place for place in structure.places}
    chosen: dict[tuple[str, str, str], Placed] = {}
    for search in searches:
        best: list[tuple[str, str, str]] = []
        for fitted in search.ranked():
            for placed in fitted.hypothesis:
                if placed.key not in best and len(best) < count:
                    best.append(placed.key)
                    chosen[placed.key] = Placed(placed.effect, places[placed.place.name], placed.target)
    return list(chosen.values())
