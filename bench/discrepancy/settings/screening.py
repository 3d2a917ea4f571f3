"""Thresholds of the room `screening`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ScreeningSettings:
    """Screening of the catalogue along the measured motion, and the score test of what an explanation leaves."""

    worth_a_fit: float = setting(
        25.0,
        "Screened gain in chi-squared from which one more effect is fitted.",
        "It has to overcome the prior (2 x 3.4) and the Occam factor of its parameters.",
        unit="chi2",
    )
    short: float = setting(
        0.15,
        "Effects with less than this part of the best screened gain are not fitted.",
        "Sealed cases: true effects were screened at more; a cost cut-off.",
    )
    trusted: float = setting(
        0.5,
        "The same where one more effect is screened about a free run that follows the motion.",
        "Gains are what they seem then.",
    )
    refined_effects: int = setting(
        12, "Effects whose grid points are refined along the measured motion.", "A cost cut-off."
    )
    refined_starts: int = setting(3, "Grid points refined of each.", "A cost cut-off.")
    apart: float = setting(
        0.8,
        "Distance of starts of an effect, in prior standard deviations of its grid parameters.",
        "Nearer ones end in one minimum.",
        unit="sigmas",
    )
    nearly: float = setting(
        0.9,
        "Part of the gain of its best start from which a further start of an effect is fitted.",
        "A cost cut-off.",
    )
    signal_step: float = setting(
        0.1,
        "Value of eta at which a signed channel effect without grid is tried.",
        "Small enough to be linear, large enough to be no rounding.",
        unit="sigmas",
    )
    imitated: float = setting(
        1e-10,
        "Part of an effect's squared response that rounding leaves of one that the base imitates.",
        "Single precision of the columns, squared, with margin.",
    )
    knots: int = setting(
        12,
        "Knots of a free force of one coordinate.",
        "Between them it is straight: an interpolation error of a percent for smooth forces.",
    )
    own: float = setting(
        1e-3,
        "Part of a model's columns that has to be its own.",
        "Less is nothing but the base's inaccuracy.",
    )
    faint: float = setting(
        4e-3,
        "Part of its own below which a model finds more than noise in clean records.",
        "81 clean sealed cases of seeds 20261205 and 20261206.",
    )
    scatter: float = setting(
        1.25,
        "By how much its coefficients scatter there, over the noise.",
        "The same study: 1.25 below, 1.0 above.",
    )
    significance: float = setting(
        1e-3,
        "Probability with which noise alone may call an explanation of one effect lacking.",
        "Error of the first kind, stated as such.",
    )
    significance_of_several: float = setting(
        0.01,
        "The same of an explanation of several effects.",
        "What several laws together imitate is as often one law that no catalogue holds.",
    )
    inaccuracy: float = setting(
        5e-4,
        "Part of chi-squared that is laid to the smoothing and integration of the diagnosis.",
        "Measured on clean cases.",
    )
    exactness: float = setting(
        1e-4,
        "Part of the chi-squared an explanation takes away that its laws may leave.",
        "A hundredth of the missing force.",
    )
    draws: int = setting(
        16,
        "Draws of the noise that are sent through an explanation in doubt.",
        "What they gain is known to some 10 % then.",
    )
    imitating: int = setting(
        3, "Number of effects that together imitate nearly any force.", "Sealed cases of unknown forces."
    )
    strictness: float = setting(
        1e-5,
        "Part of the chi-squared taken away that so many may leave.",
        "What they leave of a law of their own is small.",
    )
    refined: float = setting(
        1e-3, "Part of chi-squared that is not worth a step of a refinement.", "A cost cut-off."
    )
    refining_reach: float = setting(
        1.5,
        "Longest step of a refinement in prior standard deviations.",
        "The columns are linear about that far.",
        unit="sigmas",
    )
    largest: float = setting(
        1000000000000000.0,
        "Whitened response beyond which a grid point counts as diverged.",
        "Squares of it still sum without overflow.",
    )
    small_change: float = setting(
        1e-3,
        "Change of the channels, over their peak, whose effect behind a sensor is taken.",
        "A cube root of rounding in single precision.",
    )
    shape_step: float = setting(
        0.02,
        "Finite difference in the shape parameters of a base effect.",
        "Large against the roughness that stick-slip leaves in the cost.",
        unit="sigmas",
    )
    run_step: float = setting(
        1e-3,
        "The same in all parameters where free runs are compared.",
        "Free runs are smoother than the measured motion.",
        unit="sigmas",
    )
