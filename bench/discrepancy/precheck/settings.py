"""Thresholds of the check."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CheckSettings:
    """When something counts.

    Attributes:
        matters: Change of a response, over its rms, of an effect at the size that would matter. A fit that good is what a model of a
            machine is called accurate for; smaller effects hide in the 5 to 10 % by which nominal parameters are off.
        identifiable: Posterior over prior standard deviation of a nominal parameter up to which the records tell it.
        weak: The same up to which they tell something of it; above it the stated value stays what it was.
        certain: Chi-squared that an effect keeps once the nominal parameters have taken what they can, from which it can be named: five
            sigmas, the evidence that the search itself asks for before it fits (`worth_a_fit` of the screening).
        hint: The same from which it shows: three sigmas.
        reach: Prior standard deviations within which an effect has to reach the size that matters.
        records_seconds: Seconds of each record that the information is computed on, so that it takes seconds itself.
        motion_seconds: Seconds of each record of a robot that are looked at joint by joint: several periods of slow motion.
        shift: Power that is left of the residual at the best shift in time, over that at none, from which the shift is told.
        one_sided: Share of a load's samples of one sign from which it may be a magnitude.
        unsigned: Power of a load of one sign that the load which the motion implies leaves, from which it may be the magnitude of that.
        magnitude: What the magnitude of that leaves over it, below which it is: a model that is wrong leaves as much of both.
        glitch: Jump from a neighbour to a sample and back, over what the samples around do at most, from which it is a torn value.
        frozen: Samples in a row with one value, of a channel that otherwise moves at every sample, from which it is a stuck one.
        resumed: Step after them, over the 99th percentile of all, from which a position has gone on unseen: a joint that stuck on its
            friction sets off slowly.
        one_motion: Correlation, at frequencies where both are strong, below which two channels of one motion do not tell the same: what
            kinematics ties together is apart by noise alone, a thousandth there.
        far_off: Factor between measured and predicted size of all responses from which the load is another thing: a resonance in the wrong
            place makes up to its amplification of it, 10 at a damping of 5 %.
    """

    matters: float = 0.05
    identifiable: float = 0.5
    weak: float = 0.9
    certain: float = 25.0
    hint: float = 9.0
    reach: float = 4.0
    records_seconds: float = 20.0
    motion_seconds: float = 200.0
    shift: float = 0.1
    one_sided: float = 0.98
    unsigned: float = 0.05
    magnitude: float = 0.25
    glitch: float = 8.0
    frozen: int = 12
    resumed: float = 1.5
    one_motion: float = 0.9
    far_off: float = 20.0
