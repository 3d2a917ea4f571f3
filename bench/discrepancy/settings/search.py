"""Thresholds of the room `search`."""

from __future__ import annotations

from dataclasses import dataclass, field

from bench.discrepancy.settings.describing import setting
from bench.discrepancy.settings.search_parts import (
    CoggingSettings,
    CoupledSettings,
    HarmonicForceSettings,
    HorizonSettings,
    LoadReadingSettings,
    PlainSettings,
    RestartSettings,
    SoftFrictionSettings,
    TimedForceSettings,
)


@dataclass(frozen=True)
class SearchSettings:
    """The search for explanations: which hypotheses are fitted, carried on and given up."""

    thorough: int = setting(
        60,
        "Iterations of a fit that is carried on to convergence.",
        "A cost cut-off: fits end by themselves before.",
        unit="iterations",
    )
    log_prior_effect: float = setting(
        -3.4,
        "Log prior odds of one more effect.",
        "One in the number of effects of the catalogue.",
        unit="log odds",
    )
    significant: float = setting(
        4.0,
        "Standard deviations by which chi-squared exceeds its expectation where a hypothesis counts as refuted.",
        "Chance goes there once in 30 000.",
        unit="sigmas",
    )
    faint: tuple[float, ...] = setting(
        (0.3, 0.1, 0.03, 0.01),
        "Parts of the promised size from which an effect that made its base worse is begun again; the fit takes the best.",
        "Of a cubic spring and a stop four times too stiff, a tenth is another motion still, a hundredth is not.",
    )
    immaterial: float = setting(
        1e-3,
        "Relative improvement of chi-squared that one more effect has to pay for.",
        (
            "Smoothing of stick-slip and interpolation of loads are only as good as that; records of extreme signal-to-noise "
            "ratio would else name spurious terms."
        ),
    )
    hopeless: float = setting(
        3.0,
        "Excess of a first fit over that of the best one above which it is not carried on.",
        "A cost cut-off.",
    )
    within_reach: float = setting(
        30.0,
        "Difference in log posterior that carrying a first fit on to convergence may still make up.",
        "A cost cut-off, seen on sealed cases.",
        unit="log odds",
    )
    sight: float = setting(
        120.0,
        "Cost above that of an explanation beyond which another one is given up.",
        "Four times what convergence makes up.",
        unit="log odds",
    )
    model_error: float = setting(
        0.02,
        "Relative excess of chi-squared that is laid to the smoothing and integration of the diagnosis itself.",
        "Measured on clean cases.",
    )
    same: float = setting(
        0.3,
        "Distance within which two refined starts of an effect count as one.",
        "A third of a prior standard deviation ends in one minimum.",
        unit="sigmas",
    )
    near: float = setting(
        2.0,
        "Reduced chi-squared up to which a free run tells the motion better than the records do.",
        "It is off by less than the noise then.",
    )
    integrated: float = setting(
        4.0,
        "Sum of squares by which halving the integration steps may change the whitened residuals.",
        "Evidence stays the same to a unit or two.",
        unit="chi2",
    )
    finest: int = setting(8, "Largest multiple of the integration steps.", "A cost cut-off.")
    converging: float = setting(
        0.5,
        "Part of the last change that a further halving may make.",
        "More is no error of the integration but friction that stops elsewhere.",
    )
    quick: int = setting(
        6,
        "Iterations of a first fit.",
        "A cost cut-off; the best are carried on to convergence.",
        unit="iterations",
    )
    noticeable: float = setting(
        15.0,
        "Screened gain from which the first effect is fitted.",
        "Noise alone lets the best of the catalogue gain so much in few cases.",
        unit="chi2",
    )
    contact_levels: tuple[float, ...] = setting(
        (-2.0, -1.0, 0.0, 1.0),
        "Sizes of contacts that are simulated on their grid, in prior standard deviations from their mean.",
        "Spans what the prior holds.",
        unit="sigmas",
    )
    contact_starts: int = setting(2, "Starts of each that are fitted.", "A cost cut-off.")
    stalled: float = setting(
        0.7,
        "Part of the excess of chi-squared that one more effect may leave for a further one to be tried.",
        "A cost cut-off.",
    )
    several: int = setting(
        2,
        "Number of effects as which a force that is lacking is doubted.",
        "A second one is looked for at the least suspicion.",
    )
    considered: int = setting(
        12, "Hypotheses that are asked what they promise together with one more effect.", "A cost cut-off."
    )
    promised: int = setting(2, "Hypotheses that are extended for that alone.", "A cost cut-off.")
    unpromising: float = setting(
        0.25,
        "Part of the excess of a base that one more effect must promise to take away.",
        "A cost cut-off.",
    )
    helpful: float = setting(
        0.3,
        "Part of the excess below which a catalogued explanation is kept under a closure.",
        "Others only disturb it.",
    )
    hopeless_group: float = setting(
        5.0,
        "Reduced chi-squared of a group of degrees of freedom above which no second effect is searched on the others.",
        "Whatever it is, the whole stays unexplained.",
    )
    promising: float = setting(
        4.0,
        "Reduced chi-squared that a screening promises in every group where groups are searched before couplings.",
        "A cost cut-off.",
    )
    closures: int = setting(3, "Most closures of a group of degrees of freedom.", "A cost cut-off.")
    closures_tried: int = setting(2, "Closures tried for each.", "A cost cut-off.")
    noisier: float = setting(
        0.01,
        "Change of the reduced chi-squared with the noise behind an explanation from which the search is repeated.",
        "Less changes no odds.",
    )
    reconsidered: int = setting(
        3,
        "Explanations behind one in which something is left that are asked whether they leave nothing.",
        "A cost cut-off.",
    )
    seeds: int = setting(8, "Explanations in other weights that are fitted again.", "A cost cut-off.")
    kept: int = setting(
        12, "Hypotheses of a group that are combined with those of other groups.", "A cost cut-off."
    )
    simplified: int = setting(
        6, "Hypotheses whose effects are tried with fewer parameters.", "A cost cut-off."
    )
    challenger_lacks: float = setting(
        0.02,
        "Part of a named effect's gain along the motion that a challenger may lack.",
        "Noise in the motion leaves as much.",
    )
    scheduled: int = setting(
        4, "Effects that are tried with a schedule.", "A cost cut-off: those that come nearest alone."
    )
    scheduled_faint: float = setting(
        0.1,
        "Part of the nominal model's own friction with which more of it begins.",
        "Small enough not to stick.",
    )
    plain: PlainSettings = field(default_factory=PlainSettings)
    restarts: RestartSettings = field(default_factory=RestartSettings)
    horizons: HorizonSettings = field(default_factory=HorizonSettings)
    coupled: CoupledSettings = field(default_factory=CoupledSettings)
    readings: LoadReadingSettings = field(default_factory=LoadReadingSettings)
    soft: SoftFrictionSettings = field(default_factory=SoftFrictionSettings)
    timed: TimedForceSettings = field(default_factory=TimedForceSettings)
    cogging: CoggingSettings = field(default_factory=CoggingSettings)
    harmonic: HarmonicForceSettings = field(default_factory=HarmonicForceSettings)
