"""How large things are in a case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from fourth_laboratory_cases.sizing import nrmse
from third_laboratory_cases.logger import Table

from fifth_laboratory_cases.case import Case
from fifth_laboratory_cases.logger import logged


class Size(NamedTuple):
    """Sizes of what a case holds, as NRMSE of one response on the validation record.

    Attributes:
        effect: What the missing effect makes of it.
        background: What the small physics besides makes of it, with all that disturbs its reading but white noise.
        noise: Its white noise.
    """

    effect: float
    background: float
    noise: float


Sizes = Mapping[str, Size]
"""Sizes by the name of the response."""


def sizes_of(case: Case) -> Sizes:
    """Sizes of a case on its validation record."""
    last = len(case.records) - 1

    def without_noise(*, effect: bool, background: bool) -> Table:
        signals = case.simulated(last, effect=effect, background=background)
        return logged(case, last, signals, noise=False, background=background)

    full = without_noise(effect=True, background=True).columns
    plain = without_noise(effect=False, background=True).columns
    alone = without_noise(effect=True, background=False).columns
    sizes = {}
    for name in case.sized or case.responses:
        noise = case.channels[name].noise / float(np.std(full[name]))
        sizes[name] = Size(nrmse(plain[name], full[name]), nrmse(alone[name], full[name]), noise)
    return sizes
