"""All cases of the sixth laboratory."""

from __future__ import annotations

from sixth_laboratory_cases.chains import FLOOR, FRAME
from sixth_laboratory_cases.dampers import DAMPER, ROTARY
from sixth_laboratory_cases.oscillators import CANTILEVER, ISOLATOR
from sixth_laboratory_cases.stage import STAGE
from sixth_laboratory_cases.stand import TESTSTAND
from sixth_laboratory_cases.turning import PENDULUM, ROTOR

CASES = (
    ISOLATOR,
    CANTILEVER,
    FRAME,
    FLOOR,
    TESTSTAND,
    STAGE,
    ROTOR,
    PENDULUM,
    DAMPER,
    ROTARY,
)
"""All of them, in the order of their author."""
