"""Thresholds of the room `articulated`."""

from __future__ import annotations

from dataclasses import dataclass, field

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ArticulatedSearchSettings:
    """The search on articulated models."""

    most: int = setting(
        3,
        "Largest number of effects named together at one joint; twice as many rounds are made at most.",
        "Convention.",
    )
    fitted: int = setting(
        10,
        "Screened effects that are fitted in a round, at most; and as many wrong numbers instead of those that the fit has strained.",
        "Convention.",
    )
    least: int = setting(3, "Of those, the ones that are fitted whatever they promise.", "Convention.")
    hope: float = setting(
        0.5,
        "The others are fitted while they promise more than this part of what the best fit so far has gained.",
        "A screening is a linearisation, and errs by less than that where it matters.",
    )
    starts: int = setting(2, "Grid points from which one effect is fitted.", "Convention.")
    plays: int = setting(
        8,
        "The same of a play whose runs nothing makes forget, each of them to its end.",
        (
            "Of a light link behind a servo, in logs of 100 Hz, none of the five most promising of 34 clearances leads to the true one, "
            "and the next three do."
        ),
    )
    iterations: int = setting(20, "Steps of a fit.", "Convention.")
    tried: int = setting(
        3,
        "Steps from each of several starts of one effect, the best of which is gone on from.",
        "A fit gains most in its first steps; another basin shows in them.",
    )
    refits: int = setting(
        6,
        "Fits of one hypothesis, each with the scales that the last one left, at most.",
        "Each gains; most end after two or three.",
    )
    rescaled: float = setting(
        0.02,
        "Relative change of a scale from which a fit is repeated with it.",
        "Of twenty parameters the evidence is then known to half a nat.",
    )
    worth: float = setting(
        4.6,
        "Log posterior that a further effect has to add, ten to one being 2.3 and a hundred to one 4.6.",
        "Convention.",
    )
    softening: tuple[float, ...] = setting(
        (0.2, 0.02),
        (
            "Noise of the torque, as parts of its RMS, with which effects are screened and fitted one after the other before "
            "the stated noise holds (`ArticulatedProblem.softened`)."
        ),
        "From what a crude model errs by to what motor currents tell.",
    )
    strained: float = setting(
        3.0,
        "Deviation of a nominal parameter, in its stated standard uncertainties, from which it counts as a finding.",
        "Convention.",
    )
    sight: float = setting(
        50.0,
        "Log posterior that an explanation may have lost without one of its effects for that effect to be tried as superfluous.",
        "A cost cut-off; ten times what an effect has to add.",
    )
    finalists: int = setting(5, "Effects that are fitted again without it.", "Convention.")
    rise: float = setting(
        0.5,
        "Log posterior by which a neighbouring number of periods in a turn has to be likelier.",
        "Some twenty times what ends a fit, so that the search ends, too.",
    )


@dataclass(frozen=True)
class ArticulatedJudgementSettings:
    """The judgement on articulated models."""

    blocks: int = setting(
        24,
        "Blocks of a validation record, over which an improvement has to be sure.",
        "Some periods of the motion each.",
    )
    sure: float = setting(
        2.0,
        "Standard errors by which a further effect has to improve on the validation records.",
        "Convention.",
    )
    noise_known: float = setting(
        0.05,
        "Relative accuracy to which the stated noise is taken to be known.",
        "What leaves no more than this beyond it is complete.",
    )
    certain: float = setting(
        13.8,
        "Log posterior (odds of a million) that a further effect has to add to what is complete within the accuracy of the noise.",
        "A clean model is offered a few hundred effects, and the noise is not quite what its model says.",
    )
    ordinates: int = setting(
        8,
        "Ordinates of a periodogram below which no power is asked for.",
        "Fewer of them fluctuate by more than a third.",
    )
    draws: int = setting(
        8,
        "Draws of the parameters, for what their uncertainty leaves on the judging records.",
        "It is known to a third then, and added to the noise, which is mostly more.",
    )
    astray: float = setting(
        3.0,
        "Error of free runs, over what noise and uncertain parameters leave, from which they are explained by neither.",
        "Of an error that is one normal number all along, which is the least that a run can hold, three times its RMS is as rare as 0.3 %.",
    )
    material: float = setting(
        0.5,
        "Part of the discrepancy that the effects together have to close for them to be called its cause.",
        "Convention.",
    )
    rival: float = setting(
        4.6,
        "Difference in log posterior (odds of 100) within which explanations stand for one another.",
        "Convention.",
    )
    outside: float = setting(
        0.01,
        "Probability kept for what no catalogue holds, also where a catalogued effect explains the records.",
        "That of the linear structures (`judgement.posterior`).",
    )
    strained: float = setting(
        4.0,
        (
            "Deviation of a nominal parameter, in its stated standard uncertainties, beyond which it is not believed (one "
            "normal number in 16000 is as far out)."
        ),
        "Predictions are made with it there, the others fitted beside it, and what needs more is not complete.",
    )
    small: float = setting(
        0.05,
        (
            "Accuracy to which laws of friction hold on real joints: a further effect that does not complete the explanation has to "
            "close more of a torque, or of the squared error of free runs; in the search more of the power or of the misfit."
        ),
        "A few per cent of the friction is what published fits leave.",
    )


@dataclass(frozen=True)
class ArticulatedNextTestSettings:
    """The next test of an arm."""

    duration: float = setting(10.0, "Length of the test.", "Some periods of its slowest motion.", unit="s")
    ramp: float = setting(0.8, "Time over which a motion begins.", "A joint starts at rest.", unit="s")
    parts: tuple[float, ...] = setting(
        (0.8, 0.25),
        "Amplitudes that are tried, as parts of the reach that the records show.",
        "Wide and small.",
    )
    speeds: tuple[float, ...] = setting(
        (0.8, 0.3, 0.08),
        "Speeds that are tried, as parts of the largest that the records show.",
        "Fast to creeping.",
    )
    highest: float = setting(
        3.0,
        "Highest frequency of a motion.",
        "What arms follow; beyond it their own flexibility answers.",
        unit="Hz",
    )
    poses: int = setting(
        100, "Postures on the way that are looked at for collisions.", "One a tenth of a second."
    )
    decided: float = setting(4.6, "Log odds (of a hundred to one) from which a test decides.", "Convention.")


@dataclass(frozen=True)
class ArticulatedSettings:
    """Arms and legs: their records, fits and judgement."""

    postures: int = setting(
        8, "Random postures at which the mass matrix is compared.", "One that matters shows at nearly any."
    )
    shown: float = setting(
        0.01, "Share of the excess below which a joint counts as clean.", "A resolution of the picture."
    )
    octave: int = setting(
        32,
        "Ordinates of a record that the lowest octave of its spectrum holds at least; what is below counts with it.",
        "Their mean square is known to a quarter.",
    )
    holds: tuple[float, ...] = setting(
        (0.05, 0.95),
        "Cumulated parts of a power between which a band or an interval is said to hold it.",
        "Nine tenths of it.",
    )
    effect_reach: float = setting(
        4.0,
        "Longest step of a fit in the parameters of effects.",
        "Responses are not linear in shapes.",
        unit="sigmas",
    )
    nominal_reach: float = setting(
        40.0,
        "The same in nominal parameters.",
        "Their priors are narrow and the equations linear in them.",
        unit="sigmas",
    )
    difference: float = setting(
        1e-4,
        "Difference of a parameter for what the joints know of the masses.",
        "The equations are linear in it.",
        unit="sigmas",
    )
    kept_motions: int = setting(
        24,
        "Corrected records kept.",
        "One sensor effect's derivatives over all identification records; memory.",
    )
    kept_runs: int = setting(
        12,
        "Runs kept of every joint during a fit.",
        "The masses of an arm, between two columns of a Jacobian that leave a joint as it is; memory.",
    )
    diverged: float = setting(
        1000000.0,
        "Residual that stands for a run that is not finite.",
        "Larger than any that is one.",
        unit="sigmas",
    )
    at_bound: float = setting(1e-6, "Distance from a bound at which a parameter sits on it.", "Rounding.")
    longest_sample: float = setting(
        0.2,
        "Time between samples from which a record is refused.",
        (
            "It then holds nothing beyond 2.5 Hz, where drives and links answer; a log whose times are milliseconds called seconds is one "
            "such up to a rate of 5 kHz."
        ),
        unit="s",
    )
    longest_step: float = setting(
        1e-3,
        "Longest integration step.",
        "MuJoCo's own default is two of them, and a servo of 10 Hz is then integrated to 3e-4.",
        unit="s",
    )
    orders: tuple[float, ...] = setting(
        (-2.0, -1.0, 0.0, 1.0, 2.0),
        "Deviations, in sigmas, at which numbers that are known to within a factor are tried before they are fitted.",
        "95 % of the prior, in steps of the factor that it is known to.",
        unit="sigmas",
    )
    steps_a_sample: int = setting(
        4,
        "Integration steps a sample of a slow log, where so few tell the same, within what a further effect has to explain.",
        "The leapfrog is stable to 8 / (2 pi) of the sampling rate then, 2.5 times what the log hears.",
    )
    longest_of_few: float = setting(
        7.8e-3,
        "Longest integration step of so few.",
        "The leapfrog's relative error of a frequency is (omega h)^2 / 24: of a servo of 10 Hz a hundredth.",
        unit="s",
    )
    followed: float = setting(
        20.0,
        "Frequency up to which links are moved.",
        "What a robot is driven with lies below, and a second derivative lives on what lies above.",
        unit="Hz",
    )
    averaged: float = setting(
        1.0,
        "Interval over which a missing torque is averaged, in periods of the highest frequency that is followed.",
        "Shorter ones hold what smoothing leaves of the encoder's noise, longer ones average the motion away.",
    )
    segments: int = setting(
        8, "Segments of a log for its spectrum.", "Its power is known to a third; half overlap."
    )
    shift: float = setting(
        1e-4, "Shift of a centre of mass for its derivative.", "The equations are linear in it.", unit="m"
    )
    search: ArticulatedSearchSettings = field(default_factory=ArticulatedSearchSettings)
    judgement: ArticulatedJudgementSettings = field(default_factory=ArticulatedJudgementSettings)
    next_test: ArticulatedNextTestSettings = field(default_factory=ArticulatedNextTestSettings)
