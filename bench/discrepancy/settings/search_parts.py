"""Thresholds of the room `search` that belong to one part of it."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class PlainSettings:
    """When two plain effects are tried in place of a large one."""

    parameters: int = setting(2, "Parameters of a plain effect, at most.", "A size and a shape.")
    bases: int = setting(2, "Plain effects that are extended.", "Convention.")


@dataclass(frozen=True)
class RestartSettings:
    """Restarts of fits in which friction sticks: the cost is rough there."""

    restarted: int = setting(
        4, "Hypotheses that are fitted again from draws about their minimum, at most.", "A cost cut-off."
    )
    reach: float = setting(
        100.0,
        "Difference in log posterior that this may still make up where the best one sticks too.",
        "Two laws of friction differ by the local minima they lie in.",
        unit="log odds",
    )
    begun_again: float = setting(
        500.0,
        "Difference in log posterior that a start with the nominal parameters of the best fit may make up.",
        "Local minima of one law against another's have come to half of that.",
        unit="log odds",
    )
    rounds: int = setting(6, "Rounds of restarts.", "A cost cut-off.")
    in_vain: int = setting(
        2, "Rounds without improvement after which there is no further one.", "A cost cut-off."
    )
    draws: int = setting(48, "Draws of a round.", "A cost cut-off.")
    followed: int = setting(2, "Draws of a round that are followed to their minima.", "A cost cut-off.")
    scales: tuple[float, ...] = setting(
        (1.0, 2.0, 4.0),
        "Sizes of the draws' moves in posterior standard deviations.",
        "Local minima lie that near.",
        unit="sigmas",
    )
    gain: float = setting(
        1.0,
        "Decrease of the cost below which a round brought no improvement.",
        "Odds of less than two.",
        unit="chi2",
    )


@dataclass(frozen=True)
class HorizonSettings:
    """Fits over the beginnings of records, where a free run over the whole is too sensitive to begin with."""

    parts: tuple[float, ...] = setting(
        (1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0),
        "Parts of the records that are fitted one after the other before the whole.",
        "Errors of a sensitive motion grow in proportion to themselves: doubling keeps what one part has found a start for the next.",
        unit="part of a record",
    )
    hypotheses: int = setting(4, "Hypotheses of a size that are fitted so, at most.", "A cost cut-off.")
    shortest: int = setting(
        64, "Samples of a beginning, at least.", "Some periods of what is sampled well.", unit="samples"
    )
    missed: float = setting(
        0.5,
        "Part of what the best fit over the whole records leaves of a beginning, beyond noise, below which fits over beginnings go on.",
        "Half of it. A sensitive motion is missed by all of itself, and fitted down to the noise over a beginning.",
    )


@dataclass(frozen=True)
class CoupledSettings:
    """Effects that couple degrees of freedom."""

    hopeless_coupling: float = setting(
        50.0,
        "Reduced chi-squared of a coupling effect alone above which only a second coupling is added to it.",
        "A cost cut-off.",
    )
    hopeless_third: float = setting(
        5.0,
        "Reduced chi-squared of a pair with a coupling effect above which no third effect is added.",
        "It would repair little.",
    )
    hopeless_pair: float = setting(
        8.0,
        "Reduced chi-squared that the screening beside a coupling effect must promise to go below.",
        "Pairs that explain promise 1 to 2.",
    )
    converged_pairs: int = setting(
        4, "Pairs with a coupling effect that are carried on to convergence.", "A cost cut-off."
    )
    converged_beyond: int = setting(2, "Larger hypotheses with one that are.", "A cost cut-off.")
    trials: int = setting(4, "Effects that are fitted beside a coupling.", "A cost cut-off.")
    faint: tuple[float, ...] = setting(
        (0.3, 0.1),
        "Parts of the promised size from which an effect is begun as well.",
        "Friction that sticks at once takes the motion from a coupling.",
    )


@dataclass(frozen=True)
class LoadReadingSettings:
    """Other readings of the loads between their samples."""

    instead: float = setting(
        0.8,
        "Part of what further effects take from chi-squared that a reading of the loads has to take in their stead.",
        "The simpler explanation is preferred.",
    )
    likely: float = setting(
        0.5,
        "Part of the wanted decrease of chi-squared that a reading has to promise to first order, or it is not fitted.",
        "A cost cut-off.",
    )
    better: float = setting(
        0.5,
        "Part of chi-squared, beyond noise where it is stated, that a reading may leave with as many effects.",
        "Half the power is material.",
    )


@dataclass(frozen=True)
class SoftFrictionSettings:
    """Friction that creeps."""

    softened: int = setting(2, "Hypotheses of one size whose friction is softened.", "A cost cut-off.")
    standing_in: int = setting(
        4,
        "Effects that are tried in the place of soft friction.",
        "A cost cut-off: those that come nearest beside it.",
    )
    creeps: tuple[float, ...] = setting(
        (0.0001, 0.001, 0.01, 0.1),
        "Creep velocities, over the largest velocity, from which a fit may begin.",
        "Decades of what MuJoCo's defaults make.",
    )
    leads: tuple[float, ...] = setting(
        (0.001, 0.01), "Lead times from which a fit may begin.", "MuJoCo's default is 9.5 ms.", unit="s"
    )


@dataclass(frozen=True)
class CoggingSettings:
    """Cogging as a line in the spectrum of the missing force over the displacement."""

    samples: float = setting(
        2.0,
        "Samples within the finest pitch that is looked for, at the RMS speed.",
        "The force between two samples is lost; half of all motion is slower than that.",
    )
    finer: float = setting(
        4.0,
        "Points of that spectrum between two pitches that a stroke tells apart.",
        "The lobe of a line is two wide.",
    )
    pitches: int = setting(400, "Pitches in the stroke, at most.", "A cost cut-off.")
    most: int = setting(20000, "Samples that the spectrum is taken of, at most.", "A cost cut-off.")
    false_alarm: float = setting(
        0.01, "Probability that noise has a line anywhere in it.", "A fit decides; it costs one."
    )


@dataclass(frozen=True)
class HarmonicForceSettings:
    """A harmonic force of a frequency of its own, and hum in a reading: lines in the spectrum of what the records lack."""

    false_alarm: float = setting(
        0.01,
        "Probability that noise alone shows such a line somewhere in the spectrum of a record.",
        "Convention; a fit decides afterwards.",
    )
    neighbours: int = setting(
        24,
        "Bins on either side whose medians tell what lies about a line.",
        "Their median is right to a quarter; a resonance of 1 % damping is as wide at 50 Hz in 10 s.",
        unit="bins",
    )
    lobe: int = setting(
        3,
        "Bins on either side that belong to the line.",
        "The main lobe of the Hann window, and one.",
        unit="bins",
    )
    harmonic: float = setting(
        0.5,
        "Part of the power of a load above which its lines hold that it is harmonic, and lines at their multiples are laid to it.",
        "Most of it. The ripples in the spectrum of a swept sine hold little.",
    )
    drawn: float = setting(
        4.0,
        "Bounds of the frequency, in resolutions of the record, about the line.",
        "Its phase would turn by more than four times over the record.",
    )
    mains: tuple[float, ...] = setting(
        (50.0, 60.0), "Frequencies of the mains.", "Those of public grids.", unit="Hz"
    )
    mains_tolerance: float = setting(
        0.01, "Relative distance from them within which a line is one of the mains.", "EN 50160: 1 %."
    )
    multiples: int = setting(
        6, "Multiples of them that are looked at.", "Rectifiers of three phases have lines up to the sixth."
    )


@dataclass(frozen=True)
class TimedForceSettings:
    """A force that acts at certain times: its windows."""

    blocks: int = setting(
        1500,
        "Block means, at most, that a record is cut from.",
        "A cost cut-off: the segmentation is quadratic in them.",
    )
    price: float = setting(
        2.0,
        "Numbers that a piece costs, each log(blocks) times the variance of the means.",
        "Schwarz (1978): one level and one edge.",
    )
    stands_out: float = setting(
        0.5,
        "Part of the largest level from which a piece is a window.",
        "What is nearer to zero is what the model leaves besides.",
    )
    alike: float = setting(
        0.2, "Relative difference of levels up to which windows have the same force.", "Convention."
    )
    stair: float = setting(
        0.4,
        "Relative difference of levels from which neighbouring pieces are stairs of a force.",
        "Less is a force that the model blurs.",
    )
    shortest: int = setting(
        4, "Blocks that a window lasts at least.", "Its level is a mean of some values.", unit="blocks"
    )
    share: float = setting(
        0.7,
        "Part of the power of the missing force that windows have to take away.",
        "Less is no description of it.",
    )
    sudden: float = setting(
        0.2,
        "Time that edges take, over that of the pieces on both sides, from which a force swells rather than is switched on.",
        "Those of a sine take two thirds.",
    )
    edge_middle: tuple[float, ...] = setting(
        (0.25, 0.75),
        "Part of the height of an edge between which its time is measured.",
        "Half of it: quartiles.",
    )
    follows_motion: float = setting(
        0.6,
        "Correlation with the motion, or its direction, from which windows are those of a force of the motion.",
        "A third of the power in common.",
    )
    regular: float = setting(
        0.1,
        "Relative spread of the times between windows up to which they are told as periodic.",
        "Convention.",
    )
    refinements: int = setting(
        6, "Times that edges are moved and the force is fitted again.", "A cost cut-off."
    )
    moves: int = setting(6, "Steps by which edges are moved at once.", "A cost cut-off.")
    steps: tuple[float, ...] = setting((1.0, 0.5, 0.2), "Parts of a step that are tried.", "A line search.")
    difference: float = setting(
        0.5,
        "Part of a sample by which edges are moved to see what that changes.",
        "The force between two samples is linear in it.",
        unit="samples",
    )
