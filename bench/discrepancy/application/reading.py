"""A verdict read from its file, and what of it goes into a model."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from bench.discrepancy.application.applying import Findings
from bench.discrepancy.verdict import Estimate, Gap, NamedEffect, NominalEstimate
from bench.discrepancy.verdict_schema import VerdictDocument
from bench.documents import checked
from bench.documents.loading import load_document
from bench.errors import ParameterError


def read_verdict(path: str | Path) -> tuple[dict[str, Any], Any]:
    """A verdict as JSON values, and checked.

    Raises:
        FileFormatError: It cannot be read.
        DocumentError: It is no verdict.
    """
    document = load_document(path)
    return document, checked(VerdictDocument, document, str(path))


def findings_of(verdict: Any, *, nearest: bool = False) -> Findings:
    """The effects that a verdict names, and the nominal parameters as it has them.

    Args:
        verdict: A checked verdict, or a `Verdict`.
        nearest: Take what comes nearest where nothing is named because something unknown is missing.

    Raises:
        ParameterError: Nothing is named, and `nearest` not asked for.
    """
    effects = verdict.named
    if verdict.verdict == "unknown":
        if not nearest:
            names = " and ".join(e.name for e in verdict.nearest)
            comes = f"; --nearest applies what comes nearest ({names})" if names else ""
            raise ParameterError(f"the verdict is 'unknown', so that there is nothing to apply{comes}")
        effects = verdict.nearest
    numbers = (verdict.verdict == "unknown" and verdict.nearest_nominal) or verdict.nominal
    return Findings(tuple(_effect(e) for e in effects), tuple(_nominal(p) for p in numbers))


def gaps_left(verdict: Any) -> tuple[Gap, ...]:
    """The gaps of a verdict, checked or a `Verdict`, with what `findings_of` leaves of them."""
    names = [field.name for field in fields(Gap)]
    gaps = [Gap(**{name: getattr(gap, name) for name in names}) for gap in verdict.gaps]
    left = [_number(x) for x in verdict.nearest_left] or [math.nan] * len(gaps)
    return tuple(
        replace(gap, after=after) if math.isfinite(after) else gap
        for gap, after in zip(gaps, left, strict=True)
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _effect(e: Any) -> NamedEffect:
    return NamedEffect(
        name=e.name,
        where=e.where,
        probability=e.probability,
        parameters={
            name: Estimate(_number(x.value), _number(x.std), x.unit) for name, x in e.parameters.items()
        },
        channel=e.channel,
        equation=e.equation,
        variant=e.variant,
        law=e.law,
        theta=tuple(float(x) for x in e.theta),
    )


def _nominal(p: Any) -> NominalEstimate:
    return NominalEstimate(
        p.name,
        _number(p.value),
        _number(p.std),
        _number(p.stated),
        _number(p.stated_std),
        _number(p.shift_in_std),
        _number(p.stated_factor),
    )
