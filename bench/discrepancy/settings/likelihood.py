"""Thresholds of the room `likelihood`."""

from __future__ import annotations

from dataclasses import dataclass, field

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class ErrorSettings:
    """How the error of a model is estimated."""

    octaves: float = setting(
        0.5,
        "Width over which its spectrum is smoothed.",
        "Wider than a resonance, narrower than what tells bands apart.",
    )
    bins: int = setting(6, "Fewest frequency bins on either side.", "Convention.")
    samples: float = setting(
        8.0,
        "Independent samples an octave and record.",
        (
            "A band of an octave and the record's time are divided as a sonogram would be, into some half octaves and "
            "quarters of the record."
        ),
    )
    record_octaves: float = setting(
        10.0,
        "Octaves of a record that is compared in windows.",
        "Some thousand samples, from one period of the record to the Nyquist frequency.",
    )
    least: float = setting(
        0.01,
        "Model error that no rig goes below, as a part of the spectrum of a response.",
        "Gains of sensors are known to a percent.",
    )
    crude: float = setting(
        0.05,
        "Model error over the RMS of a channel, white, where nothing has been fitted yet.",
        "Convention.",
    )


@dataclass(frozen=True)
class LikelihoodSettings:
    """Residuals, their noise and their weights."""

    smoothed_bins: int = setting(
        9,
        "Bins over which the spectrum of the draws of a motion's noise is averaged.",
        "With eight draws its level at a frequency is known to some 12 %, and chi-squared to far less.",
        unit="bins",
    )
    motion_draws: int = setting(8, "Draws of the noise of a prescribed motion.", "See `smoothed_bins`.")
    together_bins: int = setting(
        400,
        "Bins that are whitened together, at most.",
        "Above the resonances inertia alone decides, and that does not change.",
        unit="bins",
    )
    together_above: float = setting(
        12.0,
        "Multiple of the highest natural frequency at rest up to which they go.",
        "Noise of a resonance that swings reaches far beyond it.",
    )
    together_block: int = setting(
        1000, "Instants whose responses are held at once.", "Memory.", unit="samples"
    )
    transition_terms: int = setting(
        6, "Terms of the series of a step's transition.", "Rounding at the phase of a step."
    )
    above_noise: float = setting(
        1.5,
        "Smoothed response spectrum over its noise down to which a frequency belongs to the band.",
        "Below it bins tell of nothing but noise.",
    )
    jump_residual: float = setting(
        5.0,
        "Residual that a jump within a sample of its time may leave.",
        "No more than a large draw of the noise.",
        unit="sigmas",
    )
    max_bins: int = setting(
        2500,
        "Most frequency bins of a record.",
        "Friction rattles an accelerometer up to the Nyquist frequency and one need not follow.",
        unit="bins",
    )
    start_difference: float = setting(
        1e-4,
        "Finite difference in a start, as a part of the spread of the motion.",
        "Half the digits of a simulation.",
    )
    windows: int = setting(10, "Windows a record is cut into where nothing else is asked for.", "Convention.")
    window_shortest: int = setting(
        60, "Fewest samples of a window.", "Its starts take a part of them.", unit="samples"
    )
    start_singular: float = setting(
        1e-7,
        "Relative size below which the response to one more start is nothing but rounding.",
        "Square root of machine precision, with margin.",
    )
    white_force: float = setting(
        0.01,
        "White force that stands for model error where no noise is stated, over the loads' RMS.",
        "Next to the positions' rounding only its being a force counts, not its size.",
    )
    window_largest: int = setting(
        1600, "Most samples times channels of a window.", "Its whitening is a full matrix of that size."
    )
    error: ErrorSettings = field(default_factory=ErrorSettings)
