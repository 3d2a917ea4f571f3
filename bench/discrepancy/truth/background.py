"""The background of sealed cases: small things that no model has, as every rig has them, beside what is withheld.

Some act on the joint: a hidden resonator, friction that varies along the stroke, a stiffness that changes slowly. Others come into
the records only: mains hum, coloured noise, a sampling clock that jitters. None is an effect of the catalogue. Together they make a
stated part of the discrepancy of the main effect; the noise is stated rightly, too small, or not at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from bench.arrays import Array
from bench.discrepancy.truth.background_settings import STATED, BackgroundSettings
from bench.discrepancy.truth.foreign_memory import HIDDEN_RESONATOR
from bench.discrepancy.truth.foreign_shapes import modulated, resonator, wavy
from bench.discrepancy.truth.ground_truth import WithheldEffect
from bench.discrepancy.truth.out_of_catalogue import MODULATED_STIFFNESS, POSITION_DEPENDENT_FRICTION
from bench.discrepancy.truth.recipe import Recipe, Shape, between
from bench.discrepancy.truth.rigs import Bench, reach_of

RecordArrays = Sequence[dict[str, Array]]


@dataclass(frozen=True)
class Background:
    """What a case holds besides.

    Attributes:
        acting: What acts on the joint.
        recorded: Names of what comes into the records only, to the part of a channel's standard deviation that it makes.
        share: Its part of the main discrepancy.
        main: That discrepancy (NRMSE): what re-estimated parameters leave of the effect's; the wanted one where nothing is withheld.
        stated: What is said of the noise, one of `STATED`.
        settings: What it was drawn from.
    """

    acting: tuple[WithheldEffect, ...] = ()
    recorded: Mapping[str, float] = field(default_factory=dict)
    share: float = 0.0
    main: float = 0.0
    stated: str = "true"
    settings: BackgroundSettings = field(default_factory=BackgroundSettings)

    def noise_stated(self, level: float) -> float | None:
        """What is stated of a noise of a level."""
        return {"true": level, "small": self.settings.understated * level, "no": None}[self.stated]

    def answer(self) -> dict[str, Any]:
        """Its entries of an answer."""
        names = [placed.recipe.name for placed in self.acting] + list(self.recorded)
        told = {"background_share": self.share, "main_gap": self.main, "noise_stated": self.stated}
        return {"background": names, **told}

    def recorded_in(
        self, clean: RecordArrays, *, judged: str, timed: Sequence[str], step: float, rng: np.random.Generator
    ) -> list[dict[str, Array]]:
        """Records with what comes into them.

        Args:
            clean: Channels of every record.
            judged: Channel by which the jitter is scaled.
            timed: Channels into which it comes: those that the logger samples.
            step: Time between samples [s].
            rng: Source of randomness.
        """
        parts = self.recorded
        out = [dict(record) for record in clean]
        scale = {name: float(np.std(np.concatenate([r[name] for r in clean]))) for name in timed}
        if "jitter" in parts:
            slope = float(np.std(np.concatenate([np.gradient(r[judged], step) for r in clean])))
            late = min(parts["jitter"] * scale[judged] / max(slope, 1e-300), self.settings.jitter * step)
            out = [_jittered(record, timed, late, step, rng) for record in out]
        frequency = float(rng.choice([50.0, 60.0]))
        for record in out:
            for name in timed:
                n = len(record[name])
                if "hum" in parts:
                    phase = 2.0 * np.pi * (frequency * step * np.arange(n) + rng.random())
                    record[name] = record[name] + math.sqrt(2.0) * parts["hum"] * scale[name] * np.sin(phase)
                if "coloured_noise" in parts:
                    record[name] = record[name] + parts["coloured_noise"] * scale[name] * _coloured(n, rng)
        return out


def _jittered(
    record: dict[str, Array], timed: Sequence[str], late: float, step: float, rng: np.random.Generator
) -> dict[str, Array]:
    """A record sampled at times that are off by a standard deviation of `late`, all channels at once."""
    n = len(next(iter(record.values())))
    clock = step * np.arange(n)
    times = np.clip(clock + late * rng.standard_normal(n), 0.0, clock[-1])
    return {
        name: make_interp_spline(clock, samples, k=3)(times) if name in timed else samples
        for name, samples in record.items()
    }


def _coloured(n: int, rng: np.random.Generator) -> Array:
    """Noise (n,) of unit standard deviation whose amplitude falls with frequency, as that of amplifiers and of drifting sensors."""
    frequency = np.maximum(np.arange(n // 2 + 1), 1)
    spectrum = (rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))) / frequency
    spectrum[0] = 0.0
    samples = np.fft.irfft(spectrum, n)
    return np.asarray(samples / np.std(samples), dtype=np.float64)


ACTING = (
    Recipe("hidden_resonator", "joint", resonator((1.5, 6.0), (0.02, 0.1)), law=HIDDEN_RESONATOR),
    Recipe("stroke_friction", "joint", wavy(0.7), law=POSITION_DEPENDENT_FRICTION),
    Recipe(
        "slow_stiffness",
        "joint",
        modulated(lambda rng, r: rng.uniform(0.3, 1.0) / r.duration),
        law=MODULATED_STIFFNESS,
    ),
)
RECORDED = ("hum", "coloured_noise", "jitter")
PLACES = {"sdof": ("",), "damper": ("",), "joint": ("axial", "torsional")}
GapOf = Callable[[Sequence[WithheldEffect]], float]


def draw_background(
    bench: Bench,
    bare: RecordArrays,
    rng: np.random.Generator,
    settings: BackgroundSettings,
    bisections: int,
    *,
    main: float,
) -> Background | None:
    """Draw a background of a wanted size; None where one of its parts cannot reach it.

    Args:
        bench: The rig.
        bare: Its responses in the records for identification without anything.
        rng: Source of randomness.
        settings: What to draw from.
        bisections: Halvings of the logarithm of a strength between e^-9 and e^2.
        main: The main discrepancy (NRMSE), of which it makes a part.
    """
    if rng.random() < settings.bare:
        return Background(main=main, stated="no", settings=settings)
    stated = str(rng.choice(STATED, p=settings.noise))
    share = between(rng, *settings.share)
    count = int(rng.integers(settings.pieces[0], settings.pieces[1] + 1))
    chosen = rng.permutation([*(recipe.name for recipe in ACTING), *RECORDED])[:count]
    sizes = rng.uniform(0.5, 1.0, count)
    parts = dict(zip(chosen, share * main * sizes / np.linalg.norm(sizes), strict=True))

    def gap(acting: Sequence[WithheldEffect]) -> float:
        return max(bench.gaps(bench.responses(acting, quick=True, judging=False), bare))

    acting = []
    for recipe in ACTING:
        if recipe.name not in parts:
            continue
        where = str(rng.choice(PLACES[bench.plan.rig]))
        placed = _sized(
            recipe, where, recipe.draw(rng, reach_of(bench, where)), gap, parts[recipe.name], bisections
        )
        if abs(np.log(gap([placed]) / parts[recipe.name])) > settings.missed:
            return None
        acting.append(placed)
    recorded = {name: float(parts[name]) for name in RECORDED if name in parts}
    return Background(tuple(acting), recorded, share, main, stated, settings)


def _sized(
    recipe: Recipe, where: str, shape: Shape, gap: GapOf, wanted: float, bisections: int
) -> WithheldEffect:
    low, high = -9.0, 2.0
    for _ in range(bisections):
        middle = 0.5 * (low + high)
        smaller = gap([WithheldEffect(recipe, where, shape(math.exp(middle)))]) < wanted
        low, high = (middle, high) if smaller else (low, middle)
    return WithheldEffect(recipe, where, shape(math.exp(0.5 * (low + high))))
