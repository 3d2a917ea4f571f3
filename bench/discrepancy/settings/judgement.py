"""Thresholds of the room `judgement`."""

from __future__ import annotations

from dataclasses import dataclass, field

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class CoarseSettings:
    """When an effect is named where the error of the model decides."""

    finalists: int = setting(10, "Explanations that are compared by blocks.", "Convention.")
    reach: float = setting(
        12.0,
        "Difference in log posterior, of the coarsened likelihood, within which one is a finalist.",
        "Convention.",
    )
    within: float = setting(
        4.0,
        "Stated standard deviations that a nominal parameter may move.",
        (
            "Gaussian tails are an assumption about small deviations; what lies farther off is a finding, and has to be "
            "named as an error of that parameter."
        ),
    )
    finding: float = setting(
        3.0,
        "The same, from which on a move is a finding: what an effect closes is held against a nominal model that moves no further.",
        "Convention, that of articulated models.",
    )
    stated_too_surely: float = setting(
        0.05,
        "Share of nominal parameters that may lie anywhere within these limits, whatever was stated of them.",
        "As rare as causes that no catalogue holds: where one of the two has to be, neither is likelier.",
    )
    material: float = setting(
        0.1,
        "Part of the discrepancy of the nominal model, its parameters re-estimated, that an effect closes to be named.",
        "Convention.",
    )
    pays: float = setting(
        0.7,
        "Part of the discrepancy of the validation records that a named explanation may leave at most.",
        "Half of its power.",
    )
    most: float = setting(
        0.5,
        "The same where the noise is rightly stated and all that a law of the catalogue leaves is therefore not it.",
        "Convention.",
    )
    outside: float = setting(
        0.05,
        "Share of effects that no catalogue holds among what explains records about as well as one of the catalogue does.",
        "Convention.",
    )
    unlike: float = setting(
        0.03,
        "The same among what is named and leaves next to nothing, at least.",
        (
            "Of 67 cases with a background in which an effect was named and no other came near, it was not the right one in one; "
            "Laplace's rule of succession gives 2 in 69."
        ),
    )
    besides: float = setting(
        0.3,
        "Odds that what is named is one of the small things that every rig has besides, before its size is known.",
        (
            "Of the single names that no other came near in 80 own cases with a background (scripts/small_things.py) the likelihood is "
            "within a nat of its largest from 0.05 to 0.5; further names beside the first are wrong more often."
        ),
    )
    background: float = setting(
        0.1,
        "Part of the discrepancy's power that small things leave on average.",
        "Backgrounds of 30 % leave 9 % of it.",
    )
    kind: float = setting(
        0.5,
        "Probability of a family of effects from which one of it is named.",
        "Likelier than not.",
    )
    telling: float = setting(
        4.0,
        "Difference of the scores (odds of 7) below which the samples cannot tell two explanations apart.",
        "Convention.",
    )


@dataclass(frozen=True)
class HeldOutSettings:
    """How records are cut into blocks and compared."""

    blocks: int = setting(12, "Blocks of each record.", "Convention.")
    draws: int = setting(500, "Draws of the bootstrap over blocks.", "Convention.")


@dataclass(frozen=True)
class JudgementSettings:
    """What is named, what is unknown, and how far a discrepancy is closed."""

    within_noise: float = setting(
        1.3,
        "Discrepancy over that of noise alone up to which an explanation is complete.",
        "Stated noise is never exact.",
    )
    far: float = setting(
        3.0,
        "Stated standard deviations from which a re-estimated nominal parameter is told besides.",
        "Three in a thousand of what is stated rightly lie farther off.",
        unit="sigmas",
    )
    coarse_alike: float = setting(
        2.0,
        "Standard errors of a difference within which two explanations are declared a set.",
        "95 % of a normal.",
        unit="sigmas",
    )
    about_noise: float = setting(
        1.1,
        "Times the noise below which a judged discrepancy is nothing but that.",
        "Stated noise is never exact.",
    )
    unchanged: float = setting(
        1.02, "Change of a judged discrepancy that is none.", "Stated noise is never exact."
    )
    reference_effects: int = setting(
        2,
        "Effects, at most, of the explanation that tells the error of the model.",
        "More of them take its error for effects.",
    )
    error_rounds: int = setting(3, "Estimates of the error, at most.", "A cost cut-off.")
    noise_understated: float = setting(
        1.5,
        "Noise over the stated one from which that is said.",
        "Of spectra smoothed over half an octave the quietest bins scatter by some tenths.",
    )
    quietest: float = setting(
        0.1,
        "Part of a spectrum that may be quieter than the stated noise.",
        "A tenth of the bins scatters below.",
    )
    everywhere: float = setting(
        0.5,
        "Part of the power of what a model leaves of a channel that lies all over its spectrum where that is noise.",
        "Half of the power.",
    )
    error_settled: float = setting(
        0.5,
        "Part of the power of an estimated error above which what an explanation leaves is as estimated.",
        "Half of the power.",
    )
    curve_lengths: tuple[float, ...] = setting(
        (0.15, 0.25, 0.4, 0.7, 1.2),
        "Distances within which a smooth curve keeps its course, over the largest displacement or velocity.",
        "Factors of 1.7 over what a record resolves.",
    )
    surface_lengths_along: tuple[float, ...] = setting(
        (0.2, 0.5, 1.2),
        "The same of smooth surfaces along the displacement.",
        "Coarser, since two are combined.",
    )
    surface_lengths_across: tuple[float, ...] = setting(
        (0.15, 0.4, 1.2), "The same across it.", "Coarser, since two are combined."
    )
    free_forces: int = setting(2, "Free forces that are fitted, at most.", "A cost cut-off.")
    curve_sizes: tuple[float, ...] = setting(
        (0.03, 0.1, 0.3, 1.0),
        "Sizes of a smooth curve, over the RMS load.",
        "Factors of three over what a record resolves.",
    )
    rival: float = setting(
        4.6,
        "Difference in log posterior within which two explanations count as indistinguishable.",
        "Odds of 100.",
        unit="log odds",
    )
    independent: float = setting(
        50.0,
        "Independent pieces of evidence in a record whose residuals are model error rather than noise.",
        "Convention: some octaves times some pieces of time.",
    )
    mostly: float = setting(
        0.5,
        "Part of the residual power an effect explains to be named where the noise is not stated.",
        "Half of it.",
    )
    outside: float = setting(
        0.01,
        "Share of effects that no catalogue holds, kept even where a catalogued effect reaches the noise.",
        "Of 417 named with certainty on the sealed cases of seeds 20261204 and 20261205 two were wrong.",
    )
    within: float = setting(
        0.05,
        "Share of catalogued effects among what is called unknown.",
        "Of 104 such verdicts there six were.",
    )
    check_draws: int = setting(
        8,
        "Draws of the parameters from their posterior and of the noise of the loads.",
        "A spread known to a quarter.",
    )
    contradicted: float = setting(
        2.0,
        "Error on the validation records over what noise and parameters explain from which an explanation is contradicted.",
        "Four times the power.",
    )
    steady_draws: int = setting(
        24,
        "Draws of the parameters from their posterior.",
        "A share of some percent that diverges shows in them.",
    )
    at_the_noise: float = setting(
        1.05,
        "Discrepancy over its noise floor up to which there is nothing to close.",
        "The stated noise is known to a few percent at best.",
    )
    blocks: int = setting(
        24,
        "Blocks of a validation record for the bootstrap.",
        "Some periods each, so that blocks are nearly independent.",
    )
    closure_worse: float = setting(
        1.1,
        "Discrepancy with a closure over that without, on any judged coordinate, from which the closure is withdrawn.",
        "Stated noise is never exact.",
    )
    coarse: CoarseSettings = field(default_factory=CoarseSettings)
    held_out: HeldOutSettings = field(default_factory=HeldOutSettings)
