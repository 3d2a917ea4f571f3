"""What is asked, measured and allowed at a place where an environment stands, whatever is tested there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from bench.excitation import Limits, RigPrior, Rivals
from bench.excitation.station import Station
from bench.rig import Rig


@dataclass(frozen=True, eq=False)
class StationSetup(ABC):
    """What is asked, measured and allowed at a place.

    Attributes:
        questions: One prior, or rivals of which each episode asks one.
        noise: Standard deviation of each measured channel's noise.
        limits: Limits.
        scale: What 1 stands for in observations, by channel, in the channel's unit.
        band: Frequencies excited [Hz].
        window: Default duration of a window [s].
        duration: Default duration of an episode [s].
    """

    questions: tuple[RigPrior, ...] | tuple[Rivals, ...]
    noise: Mapping[str, float]
    limits: Limits
    scale: Mapping[str, float]
    band: tuple[float, float]
    window: float
    duration: float

    @property
    @abstractmethod
    def rig(self) -> Rig:
        """A rig of the place, for its MJCF."""

    @property
    def timestep(self) -> float:
        """Interval of commands and measurements [s]."""
        return self.rig.timestep

    def station(
        self,
        n_steps: int | None = None,
        n_windows: int | None = None,
        *,
        shaping: str = "knots",
        n_knots: int = 1,
    ) -> Station:
        """The experimenter's place, by default with windows and a duration as the environments have them.

        Args:
            n_steps: Steps a window.
            n_windows: Windows of a test.
            shaping: How actions become commands.
            n_knots: Knots a window.
        """
        steps = n_steps or round(self.window / self.timestep)
        return Station(
            self.noise,
            self.scale,
            self.limits,
            self.timestep,
            steps,
            n_windows or round(self.duration / (steps * self.timestep)),
            self.band,
            shaping,
            n_knots,
            tuple(question.name for question in self.questions if isinstance(question, Rivals)),
        )
