"""Thresholds of the room `checks`."""

from __future__ import annotations

from dataclasses import dataclass, field

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ScaleSettings:
    """When a factor or a sign counts as one of the recording."""

    gross: float = setting(
        3.0,
        "Factor between two channels of one motion from which it is no error of calibration.",
        (
            "The gain errors that the catalogue itself allows for have a standard deviation of 0.3, so that this is beyond "
            "six of them."
        ),
    )
    coherence: float = setting(
        0.9, "Squared coherence from which two channels tell the same motion at a frequency.", "Convention."
    )
    strong: float = setting(
        100.0, "Power over that of the noise from which a frequency counts.", "Convention."
    )
    leak: float = setting(
        1e-4,
        "Part of the largest power below which a frequency holds what the window leaks into it.",
        "Convention.",
    )
    better: float = setting(
        10.0,
        "How many times better one factor has to describe the log ratios of all bands than no factor does.",
        "Convention.",
    )
    unit: float = setting(
        1.25,
        "Ratio up to which a factor against the nominal model is that of a unit.",
        "Nominal parameters are wrong by so much.",
    )
    any_factor: float = setting(
        10.0,
        "Factor against the nominal model that is reported whether or not it is one of a unit.",
        "No parameter that anyone states with an uncertainty is wrong by it in all bands.",
    )
    octaves: float = setting(
        2.0,
        "Width of the band in which a sign has to be turned, against the nominal model.",
        "A resonance that is misplaced by less turns the sign only within it.",
    )
    segments: int = setting(
        8, "Segments that a record is cut into for its spectra, half of each in the next one.", "Convention."
    )
    cycles: int = setting(
        6,
        "Cycles of the strongest frequency that a segment holds at least, as far as the record allows.",
        "The window spreads a line over two frequencies either way.",
    )


@dataclass(frozen=True)
class LikenessSettings:
    """When the simulation of the diagnosis and MuJoCo's count as one."""

    noise: float = setting(
        0.3,
        "RMS of the difference over the noise of a channel from which it could be taken for an effect.",
        "A third of the noise raises the power of the residuals by a tenth.",
    )
    share: float = setting(
        0.01,
        "RMS of the difference over that of the response, from which it could.",
        "What is below is less than the error that anyone expects of a simulation.",
    )
    integration: float = setting(
        3.0,
        "Times the change that halving MuJoCo's step makes which are still its own error of integration.",
        (
            "Of an integrator of the first order, the least there is, the finer run is off by that change once; where it is not yet "
            "asymptotic (a stop, a step of several time constants) by some more."
        ),
    )
    reached: float = setting(
        1.5,
        "Times the largest measured response up to which the runs are compared.",
        (
            "A part that acted in the records acts in a run before the run has left their motion: once would do. Half as much again is "
            "for parts beside the channels (a contact, a tendon), which a nominal model wrong by some sigmas reaches elsewhere. What "
            "acts only beyond (a pendulum without its friction that goes over the top) has nothing to do with the records."
        ),
    )
    steps: int = setting(
        24_000, "MuJoCo's steps spent on a case at the coarser of two step sizes.", "A second, about."
    )


@dataclass(frozen=True)
class LongRecordSettings:
    """Records for identification of more samples than a search makes use of."""

    record: int = setting(
        32_768,
        "Samples of a record that a search makes use of.",
        (
            "The longest of the records on which its figures were measured has 28 674; the likelihood weighs 2500 frequencies of a record, "
            "which would be ever lower ones."
        ),
        unit="samples",
    )
    together: int = setting(
        65_536,
        "Samples of all records together.",
        "The cases on which its figures were measured hold 60 000 at most.",
        unit="samples",
    )
    samples_a_period: float = setting(
        10.0,
        "Samples a period of the highest frequency above the noise that a record keeps when it is thinned.",
        "Straight lines between so many are off by a twentieth of what is as small as the noise there.",
        unit="samples",
    )
    above_noise: float = setting(
        2.0,
        "Smoothed spectrum of a channel over its noise down to which a frequency is kept.",
        "Of so long a record noise alone, smoothed over a two hundredth of its band, scatters by a seventh.",
    )
    unstated: float = setting(
        1e-3,
        "Part of its standard deviation that counts as the noise of a channel where none is stated.",
        "A tenth of the least error that a model is granted.",
    )
    quiet: float = setting(
        0.1,
        "Part of the RMS change of a channel below which a record that is cut has not begun to move.",
        "A hundredth of its power; noise of more than that is no silence.",
    )


@dataclass(frozen=True)
class ChecksSettings:
    """What a record and its model are checked for before the diagnosis."""

    shortest: int = setting(
        200,
        "Shortest record of a structure.",
        "Of a hundred, effects were named with which the judging record was worse: too few ordinates tell a law from its neighbours.",
        unit="samples",
    )
    shape: float = setting(
        0.9,
        "Correlation from which two signals count as the same but for a factor.",
        "Four fifths of the power in common.",
    )
    factor_between_channels: float = setting(
        0.04,
        "Relative tolerance of a factor between two channels of one motion.",
        "Calibration of a sensor is no better.",
    )
    factor_to_model: float = setting(
        0.2,
        "Relative tolerance of a factor between a response and its nominal prediction.",
        "Nominal parameters are wrong by some percent, and a resonance multiplies that.",
    )
    periods: int = setting(
        10,
        "Periods of the slowest resonance below which a record is called short.",
        "A damping ratio of some percent needs as many to show.",
        unit="periods",
    )
    samples_a_period: int = setting(
        6,
        "Samples a period of the fastest resonance below which a record is called coarse.",
        "The interpolation between samples is off by percents then.",
        unit="samples",
    )
    levelled: float = setting(
        0.01, "Part of the samples at the extreme from which a channel saturates.", "A pure sine has less."
    )
    neighbours: float = setting(
        5.0, "The same as a multiple of those in the next cell.", "A pure sine has 2.4 times as many."
    )
    approach: float = setting(
        9.0,
        "Widths of the band at the extremes from below which a signal's course is continued to see whether it was cut off there.",
        "A parabola needs some; one that comes to rest has bent by then, and one that is stepped has no sample there.",
    )
    square: float = setting(
        0.5,
        "Part of the samples at the extremes from which a signal is a square wave or a hold, not a clipped one.",
        "More than half the time at the stops is no clipping.",
    )
    understated: float = setting(
        3.0,
        "High-frequency floor of a channel over its stated noise from which that is noted.",
        "The floor holds some response as well.",
    )
    rate: float = setting(
        1e-3,
        "Relative difference of two sample rates that is no rounding.",
        "Clocks of instruments agree to far better.",
    )
    strong: float = setting(
        100.0,
        "Power over that of the noise from which a frequency counts in a comparison of two channels.",
        "Its phase is known to a tenth of a radian.",
    )
    shifts: int = setting(
        50,
        "Largest shift between load and responses that is looked for.",
        "Convention: longer ones are seen by eye.",
        unit="samples",
    )
    pieces: int = setting(
        8, "Pieces of a record over which a lag is followed.", "Convention: tells a drift from a constant."
    )
    angles: int = setting(
        1001,
        "Displacements at which the stiffness of a bending spring is looked at.",
        "Resolves the reach of a pendulum to a thousandth.",
    )
    start_share: float = setting(
        0.25,
        "Part of the slowest period over which a start is looked for.",
        "What is missing from the model has hardly grown in it.",
    )
    start_samples: int = setting(
        24,
        "Fewest samples of that.",
        "Twice the unknowns of a rig of six degrees of freedom.",
        unit="samples",
    )
    start_material: float = setting(
        0.05,
        "Least part of a channel's standard deviation that the free response to a start makes.",
        "Less changes no verdict.",
    )
    start_certain: float = setting(
        6.0,
        "Standard deviations by which a start differs from rest.",
        "Chance does not take it there in any number of records.",
        unit="sigmas",
    )
    start_forgotten: float = setting(
        0.1,
        "Power of the error beyond noise in the second half of a record over that in the first from which it has died away.",
        "Convention: a decade of power.",
    )
    start_independent: int = setting(
        4,
        "Independent pieces of what no start, force, gain or delay explains.",
        "It runs through the samples.",
    )
    start_gain: float = setting(
        0.3,
        "Prior standard deviation of a channel's gain error.",
        "Covers what sensors are ever off by without being broken.",
    )
    start_shift: float = setting(
        5.0,
        "Prior standard deviation of a channel's delay.",
        "Covers filters of an instrument.",
        unit="samples",
    )
    coarse_step: float = setting(
        4.0,
        "Step over noise from which quantisation is told.",
        "Above sqrt(12) the quantisation outweighs the noise; a little more for the estimate of the noise.",
    )
    calibration: float = setting(
        1.1,
        "Ratio between the factor of two channels and that of a unit up to which it is that unit.",
        "Errors of calibration and estimation leave as much.",
    )
    scales: ScaleSettings = field(default_factory=ScaleSettings)
    long_records: LongRecordSettings = field(default_factory=LongRecordSettings)
    likeness: LikenessSettings = field(default_factory=LikenessSettings)
