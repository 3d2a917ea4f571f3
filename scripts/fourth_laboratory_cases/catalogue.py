"""All cases of the fourth laboratory."""

from __future__ import annotations

from fourth_laboratory_cases.clean import CLEAN
from fourth_laboratory_cases.elements import ELEMENTS
from fourth_laboratory_cases.foreign import FOREIGN
from fourth_laboratory_cases.frictional import FRICTIONAL
from fourth_laboratory_cases.sensors import SENSORS

CASES = (*ELEMENTS, *SENSORS, *FRICTIONAL, *CLEAN, *FOREIGN)
"""All of them."""
