"""Encoders that are noisier than stated: the nominal model leaves white noise at every joint, and more of it than its case says.

Nobody measures the noise of an encoder as well as a long log shows it. Weighed by too little, noise is evidence for whatever is tried,
and in the end something is called missing that is not. A robot moves at the lowest frequencies; what the highest octave of the
innovations holds is noise, and tells its size. Where the model by itself leaves no more than that anywhere else, nothing is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from bench.discrepancy.articulated.explaining import Explained
from bench.discrepancy.articulated_judgement.judgement import Judge
from bench.discrepancy.articulated_judgement.whiteness import coloured
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import complete, nominal_fit
from bench.discrepancy.case.case import Case
from bench.discrepancy.judgement.coarse_finding import louder_than_stated
from bench.discrepancy.multibody.encoders import encoders_of, noise_of

LOUDER = "Nothing is missing from the model: with its parameters re-estimated it leaves white noise alone, and more of it than was stated."


def explained_with_louder_noise(
    problem: ArticulatedProblem,
    stepped: Callable[[Case], ArticulatedProblem],
    explain: Callable[[ArticulatedProblem], Explained],
    progress: Callable[[str], None],
) -> Explained | None:
    """What explains the records with the encoders as noisy as they are, where that is nothing but noise; None where it is not.

    Args:
        problem: Records for identification, their noise as stated.
        stepped: Takes a case to its problem.
        explain: Explains a problem.
        progress: Called with a line of text at every stage.
    """
    factors = noise_over_stated(problem)
    if not factors:
        return None
    progress("the noise of the encoders, larger than stated")
    louder = stepped(with_noise(problem.case, factors))
    judged, alone = louder.settings.articulated.judgement, nominal_fit(louder)
    if not complete(louder, alone, judged):
        return None
    judging = ArticulatedProblem.of(louder.case, louder.model, louder.case.validation, louder.settings)
    if coloured(judging, Judge(louder, judging).believed(alone), judged) is not None:
        return None
    found = explain(louder)
    if found.verdict.verdict != "none":
        return None
    said = louder_than_stated(factors, 1.0)
    verdict = replace(
        found.verdict, explanation=LOUDER, complete=False, warnings=(*found.verdict.warnings, *said)
    )
    return replace(found, verdict=verdict)


def noise_over_stated(problem: ArticulatedProblem) -> dict[str, float]:
    """Factor by which the channels of joints are noisier than stated: what the nominal model leaves in the highest octave.

    Empty where no joint is noisier than that can be told of stated noise.
    """
    alone, judged = nominal_fit(problem), problem.settings.articulated.judgement
    count = alone.octaves.count[:, 0]
    power = alone.chi2[:, 0] / np.maximum(count, 1.0)
    most = (1.0 + judged.noise_known) ** 2 + judged.sure * np.sqrt(2.0 / np.maximum(count, 1.0))
    return {
        channel.name: float(np.sqrt(power[j]))
        for j, joint in enumerate(problem.joints)
        if power[j] > most[j]
        for channel in encoders_of(problem.case, joint).channels
    }


def with_noise(case: Case, factors: Mapping[str, float]) -> Case:
    """A case whose channels are noisier than stated, or than the steps of their encoder are, by some factors."""
    channels = tuple(
        replace(channel, noise_std=factors[channel.name] * noise_of(channel))
        if channel.name in factors
        else channel
        for channel in case.channels
    )
    return replace(case, channels=channels)
