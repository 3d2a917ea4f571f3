"""Model of a joint with memory: `bench.laws.memory`, learned from records of its motion and force.

Three steps, each through what the law itself does along the measured motion:

1. A dictionary of slip elements of ranges spread logarithmically over the motion, beside potentials and damping along every
   direction: all weights by non-negative least squares (`bench.identification.memory_terms`), which leaves few of them above zero.
   How smooth neighbouring weights are is chosen on segments held out.
2. Terms that add nothing are dropped.
3. Ranges, profiles and relaxation times are refined by separable least squares: a step changes them, the hidden states are
   integrated anew, and the weights that belong to them are solved for. Nothing restricts how they enter, since the states do not
   depend on the weights.

`bench.identification.output_error` goes on from there where only the motion of a whole rig was measured: every parameter of the
law is a free parameter to it, and none of them within its bounds makes the joint active.
"""

from __future__ import annotations

import json
import math
import time as clock
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from itertools import combinations, pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import FileFormatError, IdentificationError, ParameterError
from bench.identification.memory_refinement import refined
from bench.identification.memory_terms import JointRecord, Terms, fold, smoothness, solve
from bench.identification.polynomial import ValidityRange, checked_data, frozen, nmse_percent
from bench.laws.base import ForceLaw
from bench.laws.evaluate import evaluate
from bench.laws.memory import memory_law
from bench.laws.memory_layout import Direction, MemoryLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MemorySettings:
    """What a joint with memory is made of before the data have chosen.

    Attributes:
        form: "sliders" (many rounded sliders) or "profiles" (few slip elements with learned slip profiles).
        directions: "axes", or "pairs": also the sum and the difference of every two coordinates, scaled by their spreads.
        slips: Slip elements along each direction, 0 for a joint without memory.
        smallest: Smallest range of a slider over the half-range of the motion; the largest is the half-range itself.
        parts: Parts of a slip element's range with stiffnesses of their own: 1 for linear springs.
        unequal: Whether the limits of a slip element may differ, as those of a band brake do.
        profile: Knots of a slip profile ("profiles" only).
        reach: Range of slip elements over the half-range of the motion ("profiles" only).
        transition: Part of a slider's range over which slip sets in ("sliders" only).
        cells: Cells of a potential.
        knots: Knots of a damping over a place, and of one over the speed.
        maxwells: Maxwell elements along each direction, relaxation times spread between a few samples and the record.
        smoothing: Strengths of smoothing that are tried on segments held out.
        negligible: Share of the force's spread below which a term is dropped.
        refine: Most steps of the refinement, 0 for none.
        max_samples: Most samples fitted; hidden states are integrated over all.
        substeps: Integration steps of the hidden states a sample: a slider of small range is passed within one sample.
    """

    form: Literal["sliders", "profiles"] = "sliders"
    directions: Literal["axes", "pairs"] = "axes"
    slips: int = 14
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
        if self.form not in ("sliders", "profiles") or self.directions not in ("axes", "pairs"):
            raise ParameterError(
                f"form '{self.form}' and directions '{self.directions}' came; sliders or profiles, and axes or pairs, are expected"
            )
        counts = (self.slips, self.parts - 1, self.profile - 1, self.cells - 1, self.knots - 2, self.maxwells)
        if min(*counts, self.refine, self.max_samples - 100, self.substeps - 1) < 0:
            raise ParameterError(f"a size among {asdict(self)} is too small")
        if not (0.0 < self.smallest < 1.0 and self.reach > 0.0 and self.smoothing):
            raise ParameterError(
                f"smallest {self.smallest:g}, reach {self.reach:g} and smoothing {self.smoothing} came; "
                "a share of the motion, a positive number and at least one strength are expected"
            )


@dataclass(frozen=True)
class MemoryReport:
    """How a fit went.

    Attributes:
        nmse: Normalised mean-square error of each force along the records, from rest [%].
        nmse_validation: The same on the segments held out, before they too were fitted [%], mean of the forces.
        n_weights: Weights that the fit began with.
        n_parameters: Parameters of the model.
        n_states: Hidden states of the model.
        smoothing: Strength of smoothing that was chosen.
        steps: Evaluations of the refinement.
        seconds: Time taken [s].
    """

    nmse: tuple[float, ...]
    nmse_validation: float
    n_weights: int
    n_parameters: int
    n_states: int
    smoothing: float
    steps: int
    seconds: float


@dataclass(frozen=True)
class MemoryModel:
    """A joint with memory in physical units, with its range of validity.

    Attributes:
        layout: What it consists of.
        parameters: Parameters of its law (n_parameters,).
        range: Range of the states it was identified from.
        report: How the fit went.
        mass: Masses (k,) [kg, kg m²] identified with it, or None.
    """

    layout: MemoryLayout
    parameters: Array = field(repr=False)
    range: ValidityRange
    report: MemoryReport
    mass: Array | None = None

    @cached_property
    def law(self) -> ForceLaw:
        """The law whose parameters these are."""
        return memory_law(self.layout)

    @cached_property
    def theta(self) -> Array:
        """Header and parameters, as an element takes them."""
        return frozen(self.law.theta(self.parameters))

    def predict(self, states: ArrayLike, *, time: ArrayLike, substeps: int = 4) -> Array:
        """Restoring forces (n, k) [N, N m] along a motion that begins at rest in the joint's virgin state.

        Args:
            states: Relative states (n, 2 k) [m, rad, m/s, rad/s].
            time: Times (n,) [s]; a new record begins where it does not increase.
            substeps: Integration steps of the hidden states a sample.
        """
        s, t = np.atleast_2d(np.asarray(states, dtype=float)), np.asarray(time, dtype=float)
        k = self.layout.n_joints
        pieces = [slice(a, b) for a, b in runs(t)]
        parts = [
            evaluate(self.law, self.theta, t[i], s[i, :k], s[i, k:], substeps=substeps).force for i in pieces
        ]
        return np.vstack(parts)

    def to_json(self) -> str:
        """The model as JSON text; numbers survive to the last bit."""
        values = {
            "type": "memory",
            "header": list(self.layout.header()),
            "parameters": self.parameters.tolist(),
            "range": self.range.to_dict(),
            "report": asdict(self.report),
            "mass": None if self.mass is None else self.mass.tolist(),
        }
        return json.dumps(values)

    @classmethod
    def from_json(cls, text: str) -> MemoryModel:
        """The model from the text of `to_json`.

        Raises:
            FileFormatError: The text is not that of a joint with memory.
        """
        try:
            values = json.loads(text)
            if values["type"] != "memory":
                raise FileFormatError(f"a model of type '{values['type']}' came; 'memory' is expected")
            layout = MemoryLayout.of_header(values["header"])
            report = {f.name: values["report"][f.name] for f in fields(MemoryReport)}
            report["nmse"] = tuple(report["nmse"])
            parameters = memory_law(layout).theta(values["parameters"])[len(values["header"]) :]
            mass = None if values["mass"] is None else frozen(values["mass"])
            return cls(
                layout,
                frozen(parameters),
                ValidityRange.from_dict(values["range"]),
                MemoryReport(**report),
                mass,
            )
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, FileFormatError):
                raise
            raise FileFormatError(f"this is no joint with memory written by `to_json`: {error}") from error


def runs(time: Array) -> list[tuple[int, int]]:
    """First sample and end of each record in a clock (n,) that starts anew where it does not increase."""
    if time.ndim != 1 or not len(time) or not np.all(np.isfinite(time)):
        raise IdentificationError(f"a clock of shape {time.shape} came; finite times (n,) are expected")
    edges = [0, *(np.flatnonzero(np.diff(time) <= 0.0) + 1).tolist(), len(time)]
    return list(pairwise(edges))


def fit_memory(
    states: ArrayLike,
    forces: ArrayLike,
    *,
    time: ArrayLike,
    accelerations: ArrayLike | None = None,
    settle: float = 0.0,
    settings: MemorySettings | None = None,
    **changes: object,
) -> MemoryModel:
    """Learn a joint with memory from records of its motion and force.

    Args:
        states: Relative states ``(n, 2 k)``, displacements before velocities [m, rad, m/s, rad/s]; records one after the other,
            each from rest in the joint's virgin state (or with `settle`).
        forces: Restoring forces ``(n, k)`` [N, N m]; with `accelerations`, applied forces less mounts.
        time: Times (n,) [s]; a new record begins where it does not increase.
        accelerations: Absolute accelerations ``(n, k)`` [m/s², rad/s²] of the body the forces act on, where its mass is unknown.
        settle: Seconds at the start of each record that are integrated and not fitted: what came before it is forgotten by then.
        settings: What the joint is made of.
        **changes: Single settings by name.

    Returns:
        The model.

    Raises:
        IdentificationError: Arrays do not fit, are not finite, are constant or too short.
        ParameterError: A setting is out of range.
    """
    begun = clock.monotonic()
    chosen = replace(settings or MemorySettings(), **changes)  # type: ignore[arg-type]
    s, f, a = checked_data(states, forces, accelerations)
    t = np.asarray(time, dtype=float)
    if t.shape != (len(s),):
        raise IdentificationError(
            f"a clock of shape {t.shape} came with {len(s)} samples; one time each is expected"
        )
    k = f.shape[1]
    spreads = np.std(f, axis=0)
    spreads[spreads == 0.0] = 1.0
    if not np.any(np.std(s, axis=0)[:k]) or len(s) < 100:
        raise IdentificationError(
            f"{len(s)} samples of a motion with the spreads {np.std(s, axis=0)[:k]} came; at least 100 of a joint in motion are expected"
        )
    records = _records(t, s, f, a, settle, chosen.max_samples)
    terms = _dictionary(chosen, s, t, a.shape[1])
    n_weights = terms.n_weights()
    strength, held_out = _strength(terms, records, spreads, chosen)
    terms, weights = _pruned(terms, records, spreads, chosen, strength)
    steps = 0
    if chosen.refine and terms.layout.slips + terms.layout.maxwells:
        terms, steps = refined(terms, records, spreads, strength, chosen.refine)
        terms, weights = _pruned(terms, records, spreads, chosen, strength)
    parameters = frozen(terms.parameters(weights))
    mass = frozen(weights[len(weights) - k :]) if a.shape[1] else None
    report = MemoryReport(
        (), held_out, n_weights, len(parameters), len(memory_law(terms.layout).states), strength, steps, 0.0
    )
    model = MemoryModel(terms.layout, parameters, ValidityRange.of(s), report, mass)
    predicted = model.predict(s, time=t, substeps=chosen.substeps) + (0.0 if mass is None else a * mass)
    kept = np.concatenate([t[i:j] - t[i] >= settle for i, j in runs(t)])
    report = replace(report, nmse=nmse_percent(f[kept], predicted[kept]), seconds=clock.monotonic() - begun)
    return replace(model, report=report)


def _records(t: Array, s: Array, f: Array, a: Array, settle: float, most: int) -> list[JointRecord]:
    """The records, with evenly spread samples to be fitted."""
    k = f.shape[1]
    pieces = runs(t)
    stride = max(1, math.ceil(len(t) / most))
    found = []
    for i, j in pieces:
        used = np.arange(0, j - i, stride)
        used = used[t[i:j][used] - t[i] >= settle]
        found.append(JointRecord(t[i:j], s[i:j, :k], s[i:j, k:], f[i:j], a[i:j], used))
    if not sum(len(record.used) for record in found):
        raise IdentificationError(f"no sample is left after a settling time of {settle:g} s; shorten it")
    return found


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


def _dictionary(settings: MemorySettings, s: Array, t: Array, n_masses: int) -> Terms:
    directions = _directions(settings, s)
    every = range(len(directions))
    sliders = settings.form == "sliders"
    slips = tuple(i for i in every for _ in range(settings.slips))
    layout = MemoryLayout(
        s.shape[1] // 2,
        directions,
        potentials=tuple(every),
        gated=tuple((i, g) for i in every for g in every),
        speeds=tuple(every),
        slips=slips,
        maxwells=tuple(i for i in every for _ in range(settings.maxwells)),
        cells=settings.cells,
        knots=settings.knots,
        speed_knots=settings.knots,
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
    return Terms(layout, ranges, profiles, relaxation, settings.unequal, n_masses, settings.substeps)


_SEGMENTS = 10
"""Segments that the samples are cut into; every other pair of them is held out in turn to choose the smoothing."""


def _strength(
    terms: Terms, records: Sequence[JointRecord], spreads: Array, settings: MemorySettings
) -> tuple[float, float]:
    """Strength of smoothing that predicts segments held out best, and the NMSE there [%]."""
    fitted, held = [], []
    for record in records:
        segment = np.minimum(
            np.arange(len(record.used)) * _SEGMENTS // max(len(record.used), 1), _SEGMENTS - 1
        )
        fitted.append(record._replace(used=record.used[segment % 4 != 3]))
        held.append(record._replace(used=record.used[segment % 4 == 3]))
    seen, unseen = fold(terms, fitted, spreads), fold(terms, held, spreads)
    losses = [unseen.loss(solve(seen, smoothness(terms, seen, x))) for x in settings.smoothing]
    best = int(np.argmin(losses))
    return settings.smoothing[best], 100.0 * losses[best] / max(unseen.total, 1e-300)


def _pruned(
    terms: Terms, records: Sequence[JointRecord], spreads: Array, settings: MemorySettings, strength: float
) -> tuple[Terms, Array]:
    """The terms without those that add nothing, and their weights."""
    factor = fold(terms, records, spreads)
    weights = solve(factor, smoothness(terms, factor, strength))
    share = np.linalg.norm(factor.R, axis=0) * weights / math.sqrt(max(factor.total, 1e-300))
    smaller = terms.without(share < settings.negligible)
    if smaller.n_weights() == terms.n_weights():
        return terms, weights
    factor = fold(smaller, records, spreads)
    return smaller, solve(factor, smoothness(smaller, factor, strength))
