"""Fig 3.10: the design model run on line on random motion, where it tracks and where it does not.

The text runs it on one record and finds that it cannot track C and n. Here it is run on three kinds of motion, from a narrow
band about one frequency, which is nearly harmonic, to 0.1 to 3 Hz. The caption of Fig 3.10 says ±0.0254 m; its axis of
displacement ends at 0.01 m, as a record of half that amplitude would have it. The widest band is run at ±0.0127 m.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from bench.figures import loops, time_histories
from bench.identification.damper import OnlineDesignFit, fit_design_model, fit_design_model_online
from bench.identification.damper_study import INCH, DamperRecord, random_record
from bench.recording import nmse
from bench.reproduction.damper_records import LOOPS, beside
from bench.reproduction.estimates import courses, fine
from bench.reproduction.item import Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import (
    VERDICT_SETUP,
    Row,
    RowVerdict,
    value_row,
)


class RandomMotion(NamedTuple):
    """A kind of random motion: band [Hz] and peak [m]."""

    name: str
    band: tuple[float, float]
    peak: float

    @property
    def frequency(self) -> float:
        """Root mean square frequency of a flat band, the number of periods a second [Hz]."""
        low, high = self.band
        return math.sqrt((low**2 + low * high + high**2) / 3.0)


NARROW = RandomMotion("0.2 to 0.3 Hz, ±25.4 mm", (0.2, 0.3), INCH)
POLYNOMIAL = RandomMotion("0.1 to 1 Hz, ±25.4 mm", (0.1, 1.0), INCH)
WIDE = RandomMotion("0.1 to 3 Hz, ±12.7 mm", (0.1, 3.0), 0.5 * INCH)


class Tracked(NamedTuple):
    """The design model on line along one record.

    Attributes:
        record: The record.
        online: Course of C and n.
        predicted: Force with the C and n of each instant (n,) [N].
        best: NMSE of the best constant pair, off line [%].
        error: NMSE of the force on line, after three periods [%].
        swing: Largest over least C after three periods.
        offline: C and n off line.
    """

    record: DamperRecord
    online: OnlineDesignFit
    predicted: np.ndarray
    best: float
    error: float
    swing: float
    offline: tuple[float, float]


def track(motion: RandomMotion, seed: int) -> Tracked:
    """Run the design model on line along one record of a kind of motion."""
    record = random_record(np.random.default_rng(seed), peak=motion.peak, band=motion.band)
    online = fit_design_model_online(record.time, record.velocity, record.force, frequency=motion.frequency)
    speed = np.abs(record.velocity)
    predicted = online.coefficients * np.sign(record.velocity) * speed**online.exponents
    late = record.time > 3.0 / motion.frequency
    fit = fit_design_model(record.velocity, record.force)
    held = online.coefficients[late]
    return Tracked(
        record,
        online,
        predicted,
        fit.nmse,
        nmse(record.force[late], predicted[late]),
        float(held.max() / held.min()),
        (fit.coefficient, fit.exponent),
    )


def rows() -> list[Row]:
    """NMSE of the force on line and the swing of C, for each kind of motion over all seeds."""
    found = []
    for motion in (NARROW, POLYNOMIAL, WIDE):
        narrow = motion is NARROW
        runs = [track(motion, seed) for seed in VERDICT_SETUP.seeds]
        error, swing = [run.error for run in runs], [run.swing for run in runs]
        printed = None if narrow else "incapable of accurately tracking C and n"
        source = "" if narrow else f"{fig('3.10')}, sentence on p. 59"
        # Where some seeds lie on the other side the sentence is not refuted, and not borne out either.
        split = RowVerdict.SHAPE if min(error) < VERDICT_SETUP.good_fit < max(error) else None
        found.append(
            value_row(
                f"design model on line on random motion, {motion.name}: NMSE of the force",
                "%",
                printed,
                error[0],
                source=source,
                reason="a good fit (section 3.4.2) on one side, no accurate tracking on the other",
                seeds=error,
                why="in a band below 1 Hz the synthetic damper still is nearly a curve, and C and n follow it to the limit of "
                "a good fit: the sentence holds where the motion is fast enough for the damper to lag",
                verdict=split,
                low=-math.inf if narrow else VERDICT_SETUP.good_fit,
                high=VERDICT_SETUP.good_fit if narrow else math.inf,
            )
        )
        found.append(
            value_row(
                f"the same: largest C over least C after three periods, {motion.name}",
                "1",
                None if narrow else "wandering C",
                swing[0],
                source="" if narrow else fig("3.10 a"),
                reason="an estimate that tracks a constant stays within a half of itself; the damper's C does not change",
                seeds=swing,
                low=-math.inf if narrow else 1.5,
                high=1.5 if narrow else math.inf,
            )
        )
        found.append(
            value_row(
                f"the best constant C and n, {motion.name}: NMSE of the force",
                "%",
                None,
                runs[0].best,
                reason="reported: what any C and n could do",
                seeds=[run.best for run in runs],
            )
        )
    return found


def pictures() -> list[Picture]:
    """Course, force and loops of the widest band (Fig 3.10), and the course in the narrow one."""
    wide, narrow = track(WIDE, VERDICT_SETUP.seeds[0]), track(NARROW, VERDICT_SETUP.seeds[0])
    records = beside(wide.record, {"design model on line": wide.predicted})
    window = (15.0, 25.0)
    return [
        Picture(
            "random_course",
            f"Random motion, {WIDE.name}: C and n on line; they follow the motion, not the damper (Fig 3.10 a, b).",
            _course(wide),
            panels("3.10", "ab"),
        ),
        Picture(
            "random_force",
            "The same: measured force and that of the design model on line (Fig 3.10 c).",
            fine(time_histories(records, ["force"], window=window)),
            panels("3.10", "c"),
        ),
        Picture(
            "random",
            "The same as loops: the design model is a curve, the damper draws loops (Fig 3.10 d, e).",
            fine(loops(records, LOOPS, window=window)),
            panels("3.10", "de"),
        ),
        Picture(
            "narrow_course",
            f"Random motion, {NARROW.name}, nearly harmonic: the design model tracks.",
            _course(narrow),
        ),
    ]


def _course(run: Tracked) -> Figure:
    return courses(
        run.online.time,
        {
            "C [kN (s/m)^n]": (1e-3 * run.online.coefficients, 1e-3 * run.offline[0], (0.0, 200.0)),
            "n [1]": (run.online.exponents, run.offline[1], (0.0, 1.0)),
        },
    )
