"""The real friction damper as a case for the diagnosis: a nominal model that knows Coulomb friction only, and two tests.

The test at 0.5 Hz serves to find what is missing, the test at 1 Hz of the same band tension to judge. The nominal friction force is
what a person reads off the 0.5 Hz loop: the median of the force against the direction of motion, and how it scatters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bench.data import friction_damper

if TYPE_CHECKING:
    from bench.discrepancy import Case, CaseRecord


@dataclass(frozen=True)
class MeasuredCaseSetup:
    """Numbers of `bench.demo.measured_case`."""

    tension: int = 80
    """Band tension of the demo's case [lbf]."""
    from_quartiles: float = 1.349
    """Quartile distance of a normal distribution in standard deviations."""


SETUP = MeasuredCaseSetup()


def damper_case(tension: int = SETUP.tension, *, thin: int = 1) -> Case:
    """The tests at one band tension as a case, in SI units.

    Args:
        tension: Band tension of a shipped test [lbf].
        thin: Only every so manieth sample; at 1024 Hz a loop of half a hertz is drawn much finer than it bends.

    Raises:
        UnknownNameError: There is no test at that tension.
    """
    from bench.discrepancy import Case, CaseChannel, NominalParameter  # noqa: PLC0415  (compiled code, for this part only)

    found = _record("identification", f"0.5Hz_{tension}lb", thin)
    opposed = found.values["force"] * np.sign(np.gradient(found.values["displacement"]))
    low, middle, high = (float(x) for x in np.percentile(opposed, [25, 50, 75]))
    return Case(
        f"friction_damper_{tension}lb",
        "damper",
        (NominalParameter("coulomb", middle, (high - low) / SETUP.from_quartiles, "N"),),
        (CaseChannel("displacement", "m", "prescribed"), CaseChannel("force", "N", "response")),
        (found,),
        (_record("validation", f"1Hz_{tension}lb", thin),),
    )


def _record(name: str, test: str, thin: int) -> CaseRecord:
    from bench.discrepancy import record_from_arrays  # noqa: PLC0415

    record = friction_damper(test).to_si()
    return record_from_arrays(
        name,
        record.time[::thin],
        {channel: record[channel][::thin] for channel in ("displacement", "force")},
    )
