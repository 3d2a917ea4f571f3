"""What a joint with memory consists of: its directions and the terms along each, as the header of its law.

The terms themselves stand in `bench.laws.memory`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bench.errors import ParameterError
from bench.laws.base import MAX_COORDINATES

FIRST = 13
"""Place of the first direction in the header: so many sizes stand before it."""

MAX_STATES = 200
"""Most hidden states: the same as an Iwan law's sliders."""


class Direction(NamedTuple):
    """A direction of a joint, and the range of the motion along it that potential and damping are resolved on."""

    vector: tuple[float, ...]
    """Factors of the coordinates (n_joints,): ``s = vector . q``."""
    low: float
    """Lower end of the range, below 0 [unit of s]."""
    high: float
    """Upper end of the range, above 0 [unit of s]."""
    speed: float
    """Largest rate that damping by speed is resolved on [unit of s over s]."""


@dataclass(frozen=True)
class MemoryLayout:
    """What a joint with memory consists of: directions, and the terms along each, every kind in the order of the directions.

    Attributes:
        n_joints: Number of coordinates.
        directions: Directions that terms act along.
        potentials: Direction of each potential.
        gated: (direction, gate) of each damping gated by place.
        speeds: Direction of each damping by speed.
        slips: Direction of each slip element.
        maxwells: Direction of each Maxwell element.
        cells: Cells of a potential.
        knots: Knots of a gated damping, at least 2.
        speed_knots: Knots of a damping by speed, at least 2.
        parts: Cells of a slip element's stiffness over its range.
        profile: Knots of a slip profile; 0 for the rounded slider.
        transition: Part of a slider's range over which slip sets in.
    """

    n_joints: int
    directions: tuple[Direction, ...]
    potentials: tuple[int, ...] = ()
    gated: tuple[tuple[int, int], ...] = ()
    speeds: tuple[int, ...] = ()
    slips: tuple[int, ...] = ()
    maxwells: tuple[int, ...] = ()
    cells: int = 1
    knots: int = 2
    speed_knots: int = 2
    parts: int = 1
    profile: int = 0
    transition: float = 0.1

    def __post_init__(self) -> None:
        if not 1 <= self.n_joints <= MAX_COORDINATES:
            raise ParameterError(
                f"a joint with memory on {self.n_joints} coordinates was asked for; 1 to {MAX_COORDINATES} are possible"
            )
        for direction in self.directions:
            ends = (direction.low, direction.high, direction.speed)
            numbers = (*direction.vector, *ends)
            if len(direction.vector) != self.n_joints or not all(map(math.isfinite, numbers)):
                raise ParameterError(
                    f"direction {direction} does not fit {self.n_joints} coordinates; as many finite factors are expected"
                )
            if not (direction.low < 0.0 < direction.high and direction.speed > 0.0):
                raise ParameterError(
                    f"direction {direction.vector} ranges from {direction.low:g} to {direction.high:g} at up to "
                    f"{direction.speed:g}; a range about 0 and a speed above 0 are expected"
                )
        used = [
            *self.potentials,
            *(i for pair in self.gated for i in pair),
            *self.speeds,
            *self.slips,
            *self.maxwells,
        ]
        if not self.directions or any(not 0 <= i < len(self.directions) for i in used):
            raise ParameterError(
                f"terms along the directions {sorted(set(used))} came with {len(self.directions)} directions"
            )
        along = (self.potentials, [i for i, _ in self.gated], self.speeds, self.slips, self.maxwells)
        if any(list(places) != sorted(places) for places in along):
            raise ParameterError(
                f"terms along the directions {[list(places) for places in along]} came; every kind in the order of its directions "
                "is expected"
            )
        sizes = (self.cells - 1, self.knots - 2, self.speed_knots - 2, self.parts - 1, self.profile)
        if min(sizes) < 0 or not 1e-3 <= self.transition <= 1.0:
            raise ParameterError(
                f"sizes of a joint with memory are out of range (cells {self.cells}, knots {self.knots}, {self.speed_knots}, "
                f"parts {self.parts}, profile {self.profile}, transition {self.transition:g})"
            )
        if len(self.slips) + len(self.maxwells) > MAX_STATES:
            raise ParameterError(
                f"{len(self.slips) + len(self.maxwells)} hidden states were asked for; at most {MAX_STATES} are possible"
            )

    @property
    def slip_size(self) -> int:
        """Parameters of a slip element: range, phi, stiffnesses, inner knots of the profile."""
        return 2 + self.parts + max(self.profile - 1, 0)

    @property
    def slip_start(self) -> int:
        """Place of the first slip element's parameters among the parameters."""
        return (
            len(self.potentials) * self.cells
            + len(self.gated) * self.knots
            + len(self.speeds) * self.speed_knots
        )

    def header(self) -> tuple[float, ...]:
        """The layout as the leading entries of theta."""
        sizes = (
            self.n_joints, len(self.directions), len(self.potentials), self.cells, len(self.gated), self.knots,
            len(self.speeds), self.speed_knots, len(self.slips), self.parts, self.profile, len(self.maxwells),
        )  # fmt: skip
        places = [x for d in self.directions for x in (*d.vector, d.low, d.high, d.speed)]
        indices = [
            *self.potentials,
            *(i for pair in self.gated for i in pair),
            *self.speeds,
            *self.slips,
            *self.maxwells,
        ]
        return tuple(float(entry) for entry in (*sizes, self.transition, *places, *indices))

    @classmethod
    def of_header(cls, header: Sequence[float]) -> MemoryLayout:
        """The layout that has this header.

        Raises:
            ParameterError: No layout has it.
        """
        try:
            sizes = [int(entry) for entry in header[:12]]
            n, count = sizes[0], sizes[1]
            width, end = n + 3, FIRST + sizes[1] * (n + 3)
            rows = [header[FIRST + i * width : FIRST + (i + 1) * width] for i in range(count)]
            directions = tuple(Direction(tuple(row[:n]), row[n], row[n + 1], row[n + 2]) for row in rows)
            indices = iter([int(entry) for entry in header[end:]])
            layout = cls(
                n,
                directions,
                potentials=tuple(next(indices) for _ in range(sizes[2])),
                gated=tuple((next(indices), next(indices)) for _ in range(sizes[4])),
                speeds=tuple(next(indices) for _ in range(sizes[6])),
                slips=tuple(next(indices) for _ in range(sizes[8])),
                maxwells=tuple(next(indices) for _ in range(sizes[11])),
                cells=sizes[3],
                knots=sizes[5],
                speed_knots=sizes[7],
                parts=sizes[9],
                profile=sizes[10],
                transition=header[12],
            )
        except (IndexError, StopIteration, RuntimeError, ValueError, OverflowError) as error:
            raise ParameterError(
                f"a header of {len(header)} numbers is that of no joint with memory"
            ) from error
        if layout.header() != tuple(float(entry) for entry in header):
            raise ParameterError(f"a header of {len(header)} numbers is that of no joint with memory")
        return layout
