"""All cases of the second laboratory, in their order."""

from __future__ import annotations

from second_laboratory_cases.components import COMPONENTS
from second_laboratory_cases.controlled import CONTROLLED
from second_laboratory_cases.mechanisms import MECHANISMS
from second_laboratory_cases.modal_tests import MODAL_TESTS
from second_laboratory_cases.shaken import SHAKEN

CASES = tuple(
    sorted((*CONTROLLED, *MODAL_TESTS, *SHAKEN, *COMPONENTS, *MECHANISMS), key=lambda case: case.number)
)
