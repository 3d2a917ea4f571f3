"""Thresholds of the room `localisation`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class LocalisationSettings:
    """Where the missing force acts."""

    region_sizes: tuple[float, ...] = setting(
        (0.01, 0.03, 0.1, 0.3, 1.0, 3.0),
        "Sizes of the coefficients to be expected, over those of the unlimited force.",
        "Factors of three.",
    )
    region_imprecise: float = setting(
        1e-4,
        "Part of the evidence that a smaller region may lack.",
        "Straight lines and smoothed motions are good to one percent of the force.",
    )
    region_ending: float = setting(
        0.01,
        "Part of the samples that a region has to save for one end more.",
        "Nobody knows what the force does where the motion seldom went.",
    )
    region_sure: float = setting(
        math.log(10.0), "Log odds of a limit from which its region is told.", "Odds of ten.", unit="log odds"
    )
    walk_intensities: tuple[float, ...] = setting(
        tuple(float(x) for x in 10.0 ** np.arange(-3.0, 2.1, 0.5)),
        "Multiples of a first guess of the walk's intensity that are compared by likelihood.",
        "Half decades over what a force may be.",
    )
    forgetting: float = setting(
        0.01,
        "Decay rate of the force over the mean circular frequency of the motion.",
        "A constant force in front of an accelerometer is not observable.",
    )
    loose: float = setting(
        300.0,
        "Standard deviation of the mean position where none is measured, over the motion.",
        "A prior without weight.",
    )
    tuned_on: int = setting(
        8000, "Samples on which the intensity is chosen.", "A cost cut-off.", unit="samples"
    )
    acts: float = setting(
        1e-5,
        "Part of an effect's largest force below which it does not act.",
        "Less than a cubic spring exerts in the cells about its middle.",
    )
    law_cells: int = setting(
        64,
        "Cells of the reach of a coordinate in which a law is asked whether it acts.",
        "A resolution of one and a half percent.",
    )
    residual_bands: int = setting(
        12,
        "Frequency bands of a residual, evenly over the logarithm of frequency.",
        "A resolution of the picture.",
    )
    residual_intervals: int = setting(
        20, "Intervals of time a residual is split into.", "A resolution of the picture."
    )
    holds: tuple[float, ...] = setting(
        (0.05, 0.95),
        "Cumulated parts of the excess between which a band or an interval is said to hold it.",
        "Nine tenths of it.",
    )
    parity_shortest: int = setting(
        24, "Samples of the shortest window.", "Quadrature of the third derivative.", unit="samples"
    )
    parity_lengths: int = setting(5, "Lengths of windows that are tried.", "Convention.")
    parity_windows: int = setting(12, "Fewest windows that a test rests on.", "A power known to 40 %.")
    parity_doubtful: float = setting(
        1e-3,
        "Probability below which, after correction, channels are said to contradict one another.",
        "Error of the first kind, stated as such.",
    )
    parity_material: float = setting(
        1.3,
        "Power of the contradiction over that of its noise below which it is not spoken of.",
        "Stated noise is never exact.",
    )
    parity_clearly: float = setting(
        2.0,
        "Ratio of what two channels leave unexplained from which on the worse one is suspected.",
        "Twice the power.",
    )
    parity_probe: float = setting(
        0.1,
        "Step of the differences in the nominal parameters.",
        "Relations are linear in them.",
        unit="sigmas",
    )
    intervals: int = setting(40, "Intervals of a record.", "A resolution of the picture.")
    false_discoveries: float = setting(
        0.05,
        "False discovery rate of cells and intervals.",
        "Benjamini and Hochberg (1995), the usual five percent.",
    )
    weak: float = setting(
        0.15,
        "Force over the largest one below which a cell or an interval belongs to no region.",
        "The smoothed force bleeds into its neighbours by as much.",
    )
    passes: int = setting(
        4, "Passes of noise alone, which count as degrees of freedom of a cell.", "Prior of its scatter."
    )
    visits: int = setting(2, "Fewest visits of a cell that is judged.", "A scatter needs two.")
    map_floor: float = setting(
        0.01,
        "Error of the estimate that is neither noise nor scatter, over the largest force.",
        "Smoothing of sudden changes.",
    )
    most_sigmas: float = setting(
        3.0,
        "Largest deviation of a nominal parameter.",
        "Chance goes beyond three times in a thousand.",
        unit="sigmas",
    )
    free_of_force: float = setting(
        3.0,
        "Standard errors within which a sample counts as free of a missing force.",
        "Chance goes beyond three times in a thousand.",
        unit="sigmas",
    )
    sparse: float = setting(
        0.25,
        "Part of the samples free of a missing force from which the deviations of the robust regression are taken.",
        "Friction that acts everywhere leaves a tenth free at most.",
    )
    robust_widths: tuple[float, ...] = setting(
        (100.0, 30.0, 10.0, 5.0, 2.0),
        "Standard errors beyond which a sample loses its pull on the robust regression, in turn.",
        "Graduated non-convexity (Blake and Zisserman 1987).",
        unit="sigmas",
    )
    robust_rounds: int = setting(3, "Linearisations of the robust regression.", "Gauss-Newton settles.")
    robust_samples: int = setting(
        3000, "Samples that the robust regression looks at.", "A cost cut-off.", unit="samples"
    )
    whole: float = setting(
        0.85,
        "Part of the visited cells along a coordinate from which a region counts as unlimited in it.",
        "The rest are cells seldom visited.",
    )
    small: float = setting(
        0.02, "Share of the missing force below which a set of touching cells is not listed.", "Convention."
    )
    force_bands: int = setting(10, "Frequency bands of the missing force.", "A resolution of the picture.")
    travels: int = setting(
        8, "Parts that the travel between two reversals is cut into.", "A resolution of the picture."
    )
    top_share: float = setting(
        1e-4,
        "Part of the power of the missing force above whose last frequency no band is drawn.",
        "A hundredth of its amplitude.",
    )
