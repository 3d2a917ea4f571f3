"""What was found of a case before its discrepancy is measured: the verdict, what is named, and how it is put into words."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.judgement.nonparametric_rival import Rival
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.verdict import NamedEffect, Ranked, VerdictKind


@dataclass(frozen=True, eq=False)
class Finding:
    """What was found of a case.

    Attributes:
        kind: The verdict.
        probabilities: Of "effect", "none" and "unknown".
        explanations: What is named first, the nominal model alone among them.
        named: Effects of the first explanation.
        ranking: Effects by decreasing probability.
        indistinguishable: Sets of names that may stand for one another.
        words: The verdict in a sentence or two.
        rival: A free force that does better than the laws, if any.
        doubt: What speaks against an explanation that leaves nothing but noise; empty where nothing does.
        nearest: Where nothing is named, the effects that come nearest, with their parameters.
        closest: The explanation that has these.
        notes: What else the reader has to know.
        coarse: Whether the error of the model decided, rather than noise.
    """

    kind: VerdictKind
    probabilities: dict[str, float]
    explanations: tuple[Explanation, ...]
    named: tuple[NamedEffect, ...]
    ranking: tuple[Ranked, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    words: str
    rival: Rival | None = None
    doubt: str = ""
    nearest: tuple[NamedEffect, ...] = ()
    closest: Explanation | None = None
    notes: tuple[str, ...] = ()
    coarse: bool = False
