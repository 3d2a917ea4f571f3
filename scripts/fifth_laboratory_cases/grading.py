"""What is right of the cases: `acceptance.json`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fifth_laboratory_cases.case import Case

WRITTEN = "2026-11-30, from what was simulated, before any diagnosis; measured_cases.py reads right, also, nrmse and why"
"""When the rules were written, and what reads them."""


def acceptance(cases: Sequence[Case]) -> dict[str, Any]:
    """Content of `acceptance.json`."""
    entries = {
        case.name: {
            "right": [list(group) for group in case.right],
            "also": list(case.also),
            "nrmse": case.limit,
            "why": case.why,
        }
        for case in cases
    }
    return {"written": WRITTEN, "cases": entries}
