"""What the backgrounds of sealed cases are drawn from."""

from __future__ import annotations

from dataclasses import dataclass

from bench.errors import ParameterError

STATED = ("true", "small", "no")
"""What is said of the noise: its size, too small a size, nothing."""


@dataclass(frozen=True)
class BackgroundSettings:
    """What backgrounds are drawn from.

    Attributes:
        share: Smallest and largest part of the main discrepancy (NRMSE: what re-estimated nominal parameters leave of it), drawn
            log-uniformly.
        pieces: Fewest and most things in a background.
        noise: Probabilities of noise that is stated rightly, too small, and not at all.
        understated: Stated noise over the true one where it is too small.
        bare: Probability of no background: the noise is not stated then.
        jitter: Standard deviation of the clock over a sample, at most: a logger that is off by more loses samples.
        missed: Relative distance to the wanted discrepancy from which a background is drawn again.
    """

    share: tuple[float, float] = (0.05, 0.3)
    pieces: tuple[int, int] = (1, 4)
    noise: tuple[float, float, float] = (0.4, 0.3, 0.3)
    understated: float = 0.4
    bare: float = 0.15
    jitter: float = 0.4
    missed: float = 0.2

    def __post_init__(self) -> None:
        low, high = self.share
        if not 0.0 < low <= high < 1.0:
            raise ParameterError(
                f"the background's part of the discrepancy came as {low:g} to {high:g}; expected 0 < low <= high < 1"
            )
