"""Model of a joint with memory: `bench.laws.memory`, learned from records of its motion and force.

Three steps, each through what the law itself does along the measured motion:

1. A dictionary of slip elements of ranges spread logarithmically over the motion, beside potentials and damping along every
   direction: all weights by non-negative least squares (`bench.identification.memory_terms`), which leaves few of them above zero.
   How smooth neighbouring weights are is chosen on segments held out.
2. MemoryTerms that add nothing are dropped.
3. Ranges, profiles and relaxation times are refined by separable least squares: a step changes them, the hidden states are
   integrated anew, and the weights that belong to them are solved for. Nothing restricts how they enter, since the states do not
   depend on the weights.

Unless its form was said, this is done for sliders and for profiles with segments of the records held out; the form that predicts
these better goes on with all samples.

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
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bench.arrays import Array
from bench.errors import FileFormatError, IdentificationError
from bench.identification.fit_data import checked_data, nmse_percent, read_only
from bench.identification.memory_refinement import refine_memory
from bench.identification.memory_settings import FORMS, MemoryForm, MemorySettings, dictionary
from bench.identification.memory_terms import MemoryRecord, MemoryTerms, fold, smoothness, solve
from bench.identification.validity_range import ValidityRange
from bench.laws.base import ForceLaw
from bench.laws.evaluate import evaluate
from bench.laws.memory import memory_law
from bench.laws.memory_energy import stored_energy
from bench.laws.memory_layout import MemoryLayout


@dataclass(frozen=True)
class MemoryReport:
    """How a fit went.

    Attributes:
        nmse: Normalised mean-square error of each force along the records, from rest [%].
        nmse_validation: The same on the segments held out, before they too were fitted [%], mean of the forces.
        form: Form of the slip elements.
        tried: Forms that were tried, and what each left of the segments held out [%]; empty where the form was given.
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
    form: str = "sliders"
    tried: tuple[tuple[str, float], ...] = ()


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
        return read_only(self.law.theta(self.parameters))

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

    def stored_energy(self, displacements: ArrayLike, memory: ArrayLike) -> Array:
        """Energy (n,) [J] held at displacements (n, k) and hidden states (n, n_states); none at rest in the virgin state."""
        return stored_energy(self.layout, self.parameters, displacements, memory)

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
            known = {f.name for f in fields(MemoryReport)}
            report = {name: value for name, value in values["report"].items() if name in known}
            report["nmse"] = tuple(report["nmse"])
            report["tried"] = tuple((name, loss) for name, loss in report.get("tried", ()))
            parameters = memory_law(layout).theta(values["parameters"])[len(values["header"]) :]
            mass = None if values["mass"] is None else read_only(values["mass"])
            return cls(
                layout,
                read_only(parameters),
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
    forms = FORMS if chosen.form == "auto" else (chosen.form,)
    tried = [
        _tried(form, chosen, records, spreads, dictionary(chosen.of_form(form), s, t, a.shape[1]), rivals=len(forms) > 1)
        for form in forms
    ]  # fmt: skip
    best = min(tried, key=lambda shape: shape.held_out)
    terms, weights, steps = _shaped(best.terms, records, spreads, chosen, best.strength)
    parameters = read_only(terms.parameters(weights))
    mass = read_only(weights[len(weights) - k :]) if a.shape[1] else None
    report = MemoryReport(
        (), best.held_out, best.n_weights, len(parameters), len(memory_law(terms.layout).states), best.strength,
        best.steps + steps, 0.0, best.form, tuple((shape.form, shape.held_out) for shape in tried if len(tried) > 1),
    )  # fmt: skip
    model = MemoryModel(terms.layout, parameters, ValidityRange.of(s), report, mass)
    predicted = model.predict(s, time=t, substeps=chosen.substeps) + (0.0 if mass is None else a * mass)
    kept = np.concatenate([t[i:j] - t[i] >= settle for i, j in runs(t)])
    report = replace(report, nmse=nmse_percent(f[kept], predicted[kept]), seconds=clock.monotonic() - begun)
    return replace(model, report=report)


def _records(t: Array, s: Array, f: Array, a: Array, settle: float, most: int) -> list[MemoryRecord]:
    """The records, with evenly spread samples to be fitted."""
    k = f.shape[1]
    pieces = runs(t)
    stride = max(1, math.ceil(len(t) / most))
    found = []
    for i, j in pieces:
        used = np.arange(0, j - i, stride)
        used = used[t[i:j][used] - t[i] >= settle]
        found.append(MemoryRecord(t[i:j], s[i:j, :k], s[i:j, k:], f[i:j], a[i:j], used))
    if not sum(len(record.used) for record in found):
        raise IdentificationError(f"no sample is left after a settling time of {settle:g} s; shorten it")
    return found


@dataclass(frozen=True)
class MemoryModuleSettings:
    """Numbers of `bench.identification.memory`."""

    segments: int = 10
    """Segments that the samples of a record are cut into; every fourth is held out to choose smoothing and form."""


SETTINGS = MemoryModuleSettings()


class _Shape(NamedTuple):
    """A form after what held-out segments have to say of it."""

    form: MemoryForm
    terms: MemoryTerms
    strength: float  # of smoothing
    held_out: float  # [%]
    n_weights: int
    steps: int


def _tried(
    form: MemoryForm,
    settings: MemorySettings,
    records: Sequence[MemoryRecord],
    spreads: Array,
    terms: MemoryTerms,
    *,
    rivals: bool,
) -> _Shape:
    """A form with its strength of smoothing and its error on segments held out; refined without them where it has rivals."""
    fitted, held = _split(records)
    seen, unseen = fold(terms, fitted, spreads), fold(terms, held, spreads)
    losses = [unseen.loss(solve(seen, smoothness(terms, seen, x))) for x in settings.smoothing]
    best = int(np.argmin(losses))
    loss, strength, steps, n_weights = losses[best], settings.smoothing[best], 0, terms.n_weights()
    if rivals:
        terms, weights, steps = _shaped(terms, fitted, spreads, settings, strength)
        loss = fold(terms, held, spreads).loss(weights)
    return _Shape(form, terms, strength, 100.0 * loss / max(unseen.total, 1e-300), n_weights, steps)


def _shaped(
    terms: MemoryTerms,
    records: Sequence[MemoryRecord],
    spreads: Array,
    settings: MemorySettings,
    strength: float,
) -> tuple[MemoryTerms, Array, int]:
    """The terms that add something, refined, their weights, and the evaluations that took."""
    terms, weights = _pruned(terms, records, spreads, settings, strength)
    steps = 0
    if settings.refine and terms.layout.slips + terms.layout.maxwells:
        terms, steps = refine_memory(terms, records, spreads, strength, settings.refine)
        terms, weights = _pruned(terms, records, spreads, settings, strength)
    return terms, weights, steps


def _split(records: Sequence[MemoryRecord]) -> tuple[list[MemoryRecord], list[MemoryRecord]]:
    """The records with the samples that are fitted, and with those held out: every fourth of ten segments of each."""
    fitted, held = [], []
    for record in records:
        segment = np.minimum(
            np.arange(len(record.used)) * SETTINGS.segments // max(len(record.used), 1), SETTINGS.segments - 1
        )
        fitted.append(record._replace(used=record.used[segment % 4 != 3]))
        held.append(record._replace(used=record.used[segment % 4 == 3]))
    return fitted, held


def _pruned(
    terms: MemoryTerms,
    records: Sequence[MemoryRecord],
    spreads: Array,
    settings: MemorySettings,
    strength: float,
) -> tuple[MemoryTerms, Array]:
    """The terms without those that add nothing, and their weights."""
    factor = fold(terms, records, spreads)
    weights = solve(factor, smoothness(terms, factor, strength))
    share = np.linalg.norm(factor.R, axis=0) * weights / math.sqrt(max(factor.total, 1e-300))
    smaller = terms.without(share < settings.negligible)
    if smaller.n_weights() == terms.n_weights():
        return terms, weights
    factor = fold(smaller, records, spreads)
    return smaller, solve(factor, smoothness(smaller, factor, strength))
