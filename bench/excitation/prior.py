"""What is not known about a rig: uncertain parameters, rival hypotheses, and draws from them.

Every uncertain parameter has a *standardised coordinate* with mean 0 and standard deviation 1 under the prior (of the value, or
of its logarithm). Sensitivities and information are taken with respect to these coordinates: they are then free of units, an
eigenvalue of the information matrix says how much more the data know than the prior, and a direction that the data leave alone
costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from bench.errors import ParameterError, UnknownNameError
from bench.rig import Rig


@dataclass(frozen=True)
class Uncertain:
    """An uncertain parameter of a rig, uniform in a range.

    Attributes:
        name: ``<element>.<parameter>``, as "gap.clearance", or ``<quantity>:<joint or body>``, as "stiffness:carriage".
        low: Smallest value, in the parameter's unit.
        high: Largest value.
        scale: "linear" (uniform) or "logarithmic" (log-uniform).
    """

    name: str
    low: float
    high: float
    scale: Literal["linear", "logarithmic"] = "logarithmic"

    def __post_init__(self) -> None:
        if self.scale not in {"linear", "logarithmic"}:
            raise UnknownNameError("scale", self.scale, ("linear", "logarithmic"))
        if not (np.isfinite([self.low, self.high]).all() and self.low < self.high):
            raise ParameterError(
                f"'{self.name}' ranges from {self.low} to {self.high}; two finite, ascending numbers are expected"
            )
        if self.scale == "logarithmic" and self.low <= 0.0:
            raise ParameterError(
                f"'{self.name}' ranges from {self.low}; a logarithmic scale needs a positive range, else give scale='linear'"
            )

    @property
    def range(self) -> tuple[float, float]:
        """Middle and standard deviation of the value, or of its logarithm where the scale is logarithmic."""
        low, high = (
            (self.low, self.high) if self.scale == "linear" else (math.log(self.low), math.log(self.high))
        )
        return 0.5 * (low + high), (high - low) / math.sqrt(12.0)

    def value(self, coordinate: float) -> float:
        """The value at a standardised coordinate."""
        middle, spread = self.range
        place = middle + spread * coordinate
        return place if self.scale == "linear" else math.exp(place)

    def coordinate(self, value: float) -> float:
        """The standardised coordinate of a value; the range is ±sqrt(3)."""
        middle, spread = self.range
        return ((value if self.scale == "linear" else math.log(value)) - middle) / spread


@dataclass(frozen=True, eq=False)
class RigHypothesis:
    """A kind of rig with uncertain parameters.

    Attributes:
        name: Name, as "gap".
        rig: The rig; uncertain parameters are overwritten by draws.
        parameters: The uncertain parameters.
        weight: Prior weight among the hypotheses of a prior, relative.
    """

    name: str
    rig: Rig
    parameters: tuple[Uncertain, ...]
    weight: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(self.parameters))
        if not (np.isfinite(self.weight) and self.weight > 0.0):
            raise ParameterError(
                f"the weight of hypothesis '{self.name}' is {self.weight}; it must be positive"
            )
        if not self.parameters:
            raise ParameterError(
                f"hypothesis '{self.name}' has no uncertain parameter; at least one is expected"
            )
        with_values(self.rig, {parameter.name: parameter.value(0.0) for parameter in self.parameters})

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the uncertain parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    def at(self, coordinates: Sequence[float] | NDArray[np.float64]) -> Draw:
        """The rig at standardised coordinates ``(n_parameters,)``."""
        values = {p.name: p.value(float(x)) for p, x in zip(self.parameters, coordinates, strict=True)}
        return Draw(self, MappingProxyType(values))

    def of(self, values: Mapping[str, float]) -> Draw:
        """The rig with given values of all uncertain parameters."""
        return Draw(self, MappingProxyType({name: float(values[name]) for name in self.names}))


@dataclass(frozen=True, eq=False)
class Draw:
    """One rig drawn from a hypothesis.

    Attributes:
        hypothesis: Where it comes from.
        values: Values of the uncertain parameters by name, in their units.
    """

    hypothesis: RigHypothesis
    values: Mapping[str, float]

    @property
    def rig(self) -> Rig:
        """The rig with these values."""
        return with_values(self.hypothesis.rig, self.values)

    @property
    def coordinates(self) -> NDArray[np.float64]:
        """Standardised coordinates ``(n_parameters,)``."""
        return np.array([p.coordinate(self.values[p.name]) for p in self.hypothesis.parameters])

    def perturbed(self, step: float) -> tuple[Rig, ...]:
        """Rigs in which one standardised coordinate after the other is moved by `step`."""
        rigs = []
        for parameter in self.hypothesis.parameters:  # the others keep their values to the last bit
            value = parameter.value(parameter.coordinate(self.values[parameter.name]) + step)
            rigs.append(with_values(self.rig, {parameter.name: value}))
        return tuple(rigs)

    def __reduce__(self) -> tuple:
        return (_draw, (self.hypothesis, dict(self.values)))


def _draw(hypothesis: RigHypothesis, values: dict[str, float]) -> Draw:
    return hypothesis.of(values)


@dataclass(frozen=True, eq=False)
class RigPrior:
    """Hypotheses about a rig, one of which holds.

    Attributes:
        hypotheses: The hypotheses; their rigs share joints, actuators and time step.
    """

    hypotheses: tuple[RigHypothesis, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "hypotheses", tuple(self.hypotheses))
        if not self.hypotheses:
            raise ParameterError("a prior needs at least one hypothesis; none came")

    @property
    def weights(self) -> NDArray[np.float64]:
        """Prior probabilities of the hypotheses."""
        weights = np.array([hypothesis.weight for hypothesis in self.hypotheses])
        return weights / weights.sum()

    def draw(self, rng: np.random.Generator) -> Draw:
        """Draw one rig."""
        hypothesis = self.hypotheses[int(rng.choice(len(self.hypotheses), p=self.weights))]
        bound = math.sqrt(3.0)
        return hypothesis.at(rng.uniform(-bound, bound, len(hypothesis.parameters)))

    def draws(self, n: int, rng: np.random.Generator) -> tuple[Draw, ...]:
        """Draw a small, evenly spread set: hypotheses in turn, Latin hypercubes within each.

        Args:
            n: Number of draws; at least one a hypothesis. Each hypothesis gets the same number, or one more: weigh the
                draws by `draw_weights`.
            rng: Source of randomness.

        Raises:
            ParameterError: Fewer draws than hypotheses.
        """
        kinds = len(self.hypotheses)
        if n < kinds:
            raise ParameterError(f"{n} draws came for {kinds} hypotheses; at least one each is expected")
        result = []
        for place, hypothesis in enumerate(self.hypotheses):
            count = n // kinds + (place < n % kinds)
            cube = qmc.LatinHypercube(len(hypothesis.parameters), rng=rng).random(count)
            result += [hypothesis.at(row) for row in math.sqrt(3.0) * (2.0 * cube - 1.0)]
        return tuple(result)

    def draw_weights(self, draws: Sequence[Draw]) -> NDArray[np.float64]:
        """Weights of draws from `draws` that sum to one, each hypothesis with its own probability."""
        kinds = [self.hypotheses.index(draw.hypothesis) for draw in draws]
        counts = np.bincount(kinds, minlength=len(self.hypotheses))
        weights = self.weights[kinds] / counts[kinds]
        return weights / weights.sum()


def with_values(rig: Rig, values: Mapping[str, float]) -> Rig:
    """A copy of a rig with other values of parameters, named as in `Uncertain`.

    Raises:
        UnknownNameError: The rig has no such element, parameter or structural quantity.
        ParameterError: A value is out of its law's bounds.
    """
    elements: dict[str, dict[str, float]] = {}
    structure: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        element, dot, parameter = name.rpartition(".")
        if dot:
            elements.setdefault(element, {})[parameter] = value
        else:
            quantity, _, place = name.partition(":")
            structure.setdefault(quantity, {})[place] = value
    for element, parameters in elements.items():
        rig = rig.with_element(rig.element(element).with_(**parameters))
    return rig.with_structure(**structure) if structure else rig
