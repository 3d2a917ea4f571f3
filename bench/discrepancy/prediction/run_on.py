"""What follows the beginning of a record that was fitted: the same explanation run on over the rest, which chose nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.checks.long_records import begun_at
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.prediction.validation_discrepancy import errors_by_block
from bench.discrepancy.search.explanation import Explanation


def rest_of_records(whole: Case, problem: Problem, final: Explanation) -> tuple[str, ...]:
    """What is said of records of which only the beginning was fitted: how the explanation does over the rest.

    Args:
        whole: The case with its records as they were before they were cut.
        problem: The problem of the beginnings.
        final: What was found.

    Returns:
        A sentence a record of which something follows.
    """
    return tuple(
        _told(record, fitted, problem, final)
        for record, fitted in zip(whole.identification, problem.case.identification, strict=True)
        if begun_at(record, fitted) + len(fitted) < len(record)
    )


def _told(whole: CaseRecord, fitted: CaseRecord, problem: Problem, final: Explanation) -> str:
    settings, samples, first = problem.settings.judgement, len(fitted), begun_at(whole, fitted)
    record = replace(fitted, values={name: values[first:] for name, values in whole.values.items()})
    n_blocks = settings.held_out.blocks * -(-len(record) // samples)
    errors = n_blocks * errors_by_block(problem, [record], final.predict, n_blocks)
    begun = samples * n_blocks // len(record)
    early, late = errors[:, :begun], errors[:, begun:]
    worst = int(np.argmax(late.mean(axis=1) / np.maximum(early.mean(axis=1), 1e-300)))
    before, after = (float(np.sqrt(part[worst].mean())) for part in (early, late))
    beyond = late[worst].mean() - early[worst].mean()
    spread = float(np.hypot(_standard_error(early[worst]), _standard_error(late[worst])))
    text = f"'{whole.name}': what was found is {before:.3g} off where it was fitted (NRMSE), {after:.3g} in what follows"
    if after > settings.within_noise * before and beyond > settings.coarse_alike * spread:
        text += (
            ": something changes with time that this verdict does not hold; diagnose a later part beside it"
        )
    return text


def _standard_error(errors: Array) -> float:
    return float(np.std(errors, ddof=1) / np.sqrt(len(errors))) if len(errors) > 1 else 0.0
