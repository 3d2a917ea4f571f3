"""Force laws: what a joint answers to a motion, each with parameters, units, bounds, reference and compiled kernels.

`LAWS` holds the catalogue; `find_law` looks a law up by its name. Importing this package compiles nothing and
does not import numba; the whole-record loop `bench.laws.evaluate.evaluate` does.
"""

from __future__ import annotations

from bench.laws.base import MAX_COORDINATES as MAX_COORDINATES
from bench.laws.base import ForceLaw as ForceLaw
from bench.laws.base import Kernel as Kernel
from bench.laws.base import Parameter as Parameter
from bench.laws.base import kernel as kernel
from bench.laws.bouc_wen_variants import generalised_bouc_wen_law as generalised_bouc_wen_law
from bench.laws.jenkins import iwan_law as iwan_law
from bench.laws.registry import LAWS as LAWS
from bench.laws.registry import describe as describe
from bench.laws.registry import find_law as find_law
