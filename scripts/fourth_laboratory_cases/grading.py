"""What is right of the cases: names that several of them share, and `acceptance.json`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from fourth_laboratory_cases.case import Case
from fourth_laboratory_cases.sizing import Sizes, limit

FRICTION = ("coulomb_friction", "stribeck_friction", "presliding_friction")
"""Names of the small dry friction that most cases have."""
SLOW = ("stiffness_drift", "carried_mass")
"""Names of their slow change and of their hidden mode."""
SETS = "a declared set that holds the right answer"
UNKNOWN = "unknown or incomplete"
BESIDE = (
    "Besides: a weak hidden mode, a little dry friction that varies along the stroke, a slow change of stiffness of 0.6 to 1.5 % "
    "(on the guide of viscous damping, 2 %), coloured sensor noise and a jittering clock (1 to 2 % of a sample)."
)
"""The background of most cases, in words."""
WRITTEN = (
    "2027-11-05, from what was simulated, before any diagnosis; measured_cases.py reads right, also, nrmse and why; acceptable, "
    "honest and wrong are the rules in words"
)
"""When the rules were written, and what reads them."""


class Graded(NamedTuple):
    """A case and its sizes."""

    case: Case
    sizes: Sizes


def why(case: Case) -> str:
    """All that is in a case, in words."""
    parts = [case.why]
    if case.usual_background:
        parts.append(BESIDE)
    if case.freeze is not None:
        parts.append(
            f"{case.freeze.channel} freezes for {case.freeze.samples} samples in {case.freeze.stem}."
        )
    return " ".join(parts)


def acceptance(all_graded: Sequence[Graded]) -> dict[str, Any]:
    """Content of `acceptance.json`."""
    entries = {
        case.name: {
            "right": [list(group) for group in case.right],
            "also": list(case.also),
            "nrmse": limit(case, sizes),
            "why": why(case),
            "acceptable": list(case.acceptable),
            "honest": list(case.honest),
            "wrong": case.wrong,
        }
        for case, sizes in all_graded
    }
    return {"written": WRITTEN, "cases": entries}
