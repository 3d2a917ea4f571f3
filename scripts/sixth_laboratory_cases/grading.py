"""What is right of the cases: `acceptance.json`, as its author wrote it before any diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sixth_laboratory_cases.case import Case


def acceptance(cases: Sequence[Case]) -> dict[str, Any]:
    """Content of `acceptance.json`."""
    entries = {
        case.name: {
            "right": [list(group) for group in case.right],
            "also": list(case.also),
            "why": case.why,
        }
        for case in cases
    }
    return {"cases": entries}
