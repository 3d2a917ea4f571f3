"""What a joint with memory is made of before the data have chosen: settings, and the dictionary of terms that they give."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from bench.arrays import Array
from bench.errors import ParameterError
from bench.identification.memory_terms import MemoryTerms
from bench.laws.memory_layout import Direction, MemoryLayout

MemoryForm = Literal["sliders", "profiles"]
FORMS: tuple[MemoryForm, ...] = ("sliders", "profiles")
"""The forms of a joint with memory."""


@dataclass(frozen=True)
class SlipSettings:
    """Slip elements along a direction where their number was not said."""

    sliders: int = 14
    """A factor of 1.5 apart in range."""
    profiles: int = 2
    """One more than a Bouc-Wen law has."""


SLIPS = SlipSettings()


@dataclass(frozen=True)
class MemorySettings:
    """What a joint with memory is made of before the data have chosen.

    Attributes:
        form: "sliders" (many rounded sliders), "profiles" (few slip elements with learned slip profiles), or "auto": both are learnt,
            and the one kept that predicts segments held out better.
        directions: "axes", or "pairs": also the sum and the difference of every two coordinates, scaled by their spreads.
        slips: Slip elements along each direction, 0 for a joint without memory; None for 14 sliders or 2 profiles.
        smallest: Smallest range of a slider over the half-range of the motion; the largest is the half-range itself.
        parts: Parts of a slip element's range with stiffnesses of their own: 1 for linear springs.
        unequal: Whether the limits of a slip element may differ, as those of a band brake do.
        profile: Knots of a slip profile ("profiles" only).
        reach: Range of slip elements over the half-range of the motion ("profiles" only).
        transition: Part of a slider's range over which slip sets in ("sliders" only).
        cells: Cells of a potential; 0 for none.
        knots: Knots of a damping over a place, and of one over the speed; 0 for none, as records of one frequency and amplitude
            ask for: they do not tell what depends on the rate from what depends on the place.
        maxwells: Maxwell elements along each direction, relaxation times spread between a few samples and the record.
        smoothing: Strengths of smoothing that are tried on segments held out.
        negligible: Share of the force's spread below which a term is dropped.
        refine: Most steps of the refinement, 0 for none.
        max_samples: Most samples fitted; hidden states are integrated over all.
        substeps: Integration steps of the hidden states a sample: a slider of small range is passed within one sample.
    """

    form: Literal["auto", "sliders", "profiles"] = "auto"
    directions: Literal["axes", "pairs"] = "axes"
    slips: int | None = None
    smallest: float = 0.004
    parts: int = 1
    unequal: bool = False
    profile: int = 6
    reach: float = 1.25
    transition: float = 0.1
    cells: int = 24
    knots: int = 13
    maxwells: int = 0
    smoothing: tuple[float, ...] = (1e-3, 1e-2, 1e-1)
    negligible: float = 1e-3
    refine: int = 12
    max_samples: int = 12_000
    substeps: int = 4

    def __post_init__(self) -> None:
        if self.form not in ("auto", *FORMS) or self.directions not in ("axes", "pairs"):
            raise ParameterError(
                f"form '{self.form}' and directions '{self.directions}' came; auto, sliders or profiles, and axes or pairs, are expected"
            )
        counts = (self.slips or 0, self.parts - 1, self.profile - 1, self.cells, self.knots, self.maxwells)
        if min(*counts, self.refine, self.max_samples - 100, self.substeps - 1) < 0:
            raise ParameterError(f"a size among {asdict(self)} is too small")
        if not (0.0 < self.smallest < 1.0 and self.reach > 0.0 and self.smoothing):
            raise ParameterError(
                f"smallest {self.smallest:g}, reach {self.reach:g} and smoothing {self.smoothing} came; "
                "a share of the motion, a positive number and at least one strength are expected"
            )

    def of_form(self, form: MemoryForm) -> MemorySettings:
        """The settings of one form, with its number of slip elements."""
        return replace(self, form=form, slips=getattr(SLIPS, form) if self.slips is None else self.slips)


def _directions(settings: MemorySettings, s: Array) -> tuple[Direction, ...]:
    k = s.shape[1] // 2
    spread = np.std(s[:, :k], axis=0)
    vectors = [row for row, size in zip(np.eye(k), spread, strict=True) if size > 0.0]
    if settings.directions == "pairs":
        for i, j in combinations(np.flatnonzero(spread > 0.0).tolist(), 2):
            for sign in (1.0, -1.0):
                vector = np.zeros(k)
                vector[i], vector[j] = 1.0, sign * spread[i] / spread[j]
                vectors.append(vector)
    found = []
    for vector in vectors:
        along, rates = s[:, :k] @ vector, s[:, k:] @ vector
        size = float(np.max(np.abs(along)))
        low, high = min(float(along.min()), -1e-3 * size), max(float(along.max()), 1e-3 * size)
        found.append(Direction(tuple(vector.tolist()), low, high, float(np.max(np.abs(rates))) or 1.0))
    return tuple(found)


def dictionary(settings: MemorySettings, s: Array, t: Array, n_masses: int) -> MemoryTerms:
    """The terms that a fit of one form (`of_form`) begins with, for states (n, 2 k) and their clock (n,)."""
    assert settings.slips is not None
    directions = _directions(settings, s)
    every = range(len(directions))
    sliders = settings.form == "sliders"
    slips = tuple(i for i in every for _ in range(settings.slips))
    layout = MemoryLayout(
        s.shape[1] // 2,
        directions,
        potentials=tuple(every) if settings.cells else (),
        gated=tuple((i, g) for i in every for g in every) if settings.knots else (),
        speeds=tuple(every) if settings.knots else (),
        slips=slips,
        maxwells=tuple(i for i in every for _ in range(settings.maxwells)),
        cells=max(settings.cells, 1),
        knots=max(settings.knots, 2),
        speed_knots=max(settings.knots, 2),
        parts=settings.parts,
        profile=0 if sliders else settings.profile,
        transition=settings.transition,
    )
    half = [0.5 * (d.high - d.low) for d in directions]
    spread = (
        np.geomspace(settings.smallest, 1.0, settings.slips)
        if sliders
        else np.full(settings.slips, settings.reach)
    )
    ranges = np.concatenate([h * spread for h in half]) if slips else np.zeros(0)
    knots = np.arange(1, layout.profile) / layout.profile if layout.profile else np.zeros(0)
    # profiles begin between a straight one (Bouc-Wen, n = 1) and ones that slip late
    powers = 2.0 ** np.arange(settings.slips)
    profiles = np.array([knots**power for _ in every for power in powers]).reshape(len(slips), len(knots))
    times = np.geomspace(
        8.0 * float(np.median(np.diff(t))), 0.25 * float(np.ptp(t)), max(settings.maxwells, 1)
    )
    relaxation = np.concatenate([times[: settings.maxwells] for _ in every])
    return MemoryTerms(layout, ranges, profiles, relaxation, settings.unequal, n_masses, settings.substeps)
