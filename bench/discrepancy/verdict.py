"""What a diagnosis says: the verdict, its parts, and their JSON form."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.files import json_values

VerdictKind = Literal["effect", "none", "unknown"]


@dataclass(frozen=True)
class Estimate:
    """A parameter estimate: value, one-sigma uncertainty, unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was named.

    Attributes:
        name: Name in the catalogue.
        where: Place: a joint or tendon of the model, "carriage", "piston", or an axis of the joint rig.
        probability: Posterior probability that it belongs to the explanation.
        parameters: Estimates by name.
        channel: Channel or nominal parameter it acts on, for actuator, sensor and inertia effects.
        equation: The effect in one line.
        variant: What tells it from the effect of the same name in the catalogue: "analogue" of a lag, "soft" of friction; mostly empty.
        law: Name of the force law in `bench.laws`, for effects that are one.
        theta: Parameters of that law, ready for an element.
        closed: Part of the judging records' discrepancy that comes back without it, everything else fitted again.
        closed_ci95: Block-bootstrap interval of `closed`.
    """

    name: str
    where: str
    probability: float
    parameters: dict[str, Estimate]
    channel: str = ""
    equation: str = ""
    variant: str = ""
    law: str = ""
    theta: tuple[float, ...] = ()
    closed: float = 0.0
    closed_ci95: tuple[float, float] = (0.0, 0.0)


def by_name(effects: Iterable[NamedEffect]) -> str:
    """Effects by name, with the places at which each is named: "coulomb_friction (elbow, wrist), damping_error (elbow)"."""
    places: dict[str, list[str]] = {}
    for effect in effects:
        places.setdefault(effect.name, []).append(effect.where)
    return ", ".join(f"{name} ({', '.join(where)})" if any(where) else name for name, where in places.items())


@dataclass(frozen=True)
class NominalEstimate:
    """A nominal parameter as the explanation has it.

    Attributes:
        name: Its name.
        value: Estimate, named errors of it included.
        std: One-sigma uncertainty.
        stated: Value that was stated.
        stated_std: Uncertainty that was stated.
        shift_in_std: Deviation from the stated value in units of the stated uncertainty, named errors not included.
        stated_factor: Factor to within which it was said to be known, one sigma of its logarithm; 1 where it was `stated_std`.
    """

    name: str
    value: float
    std: float
    stated: float
    stated_std: float
    shift_in_std: float
    stated_factor: float = 1.0

    @property
    def stated_text(self) -> str:
        """What was stated, in words."""
        if self.stated_factor > 1.0:
            return f"{self.stated:.5g}, within a factor of {self.stated_factor:.3g}"
        return f"{self.stated:.5g} ± {self.stated_std:.2g}"


def far_off(estimates: Iterable[NominalEstimate], sigmas: float) -> tuple[str, ...]:
    """Nominal parameters that an explanation moves far from what was stated, in words.

    Args:
        estimates: The nominal parameters.
        sigmas: From so many of their stated standard deviations on.
    """
    return tuple(
        f"'{p.name}' is re-estimated at {p.value:.4g}, {p.shift_in_std:+.1f} of its stated standard deviations from {p.stated:.4g}: "
        "it was stated too surely, something that scales like it is wrong, such as the gain of a sensor, or it makes up for what no "
        "effect of this explanation describes"
        for p in estimates
        if abs(p.shift_in_std) > sigmas
    )


@dataclass(frozen=True)
class Ranked:
    """An effect with its probability."""

    name: str
    where: str
    probability: float


@dataclass(frozen=True)
class Location:
    """Where residuals gather.

    Attributes:
        channel: Response channel.
        dof: Degree of freedom.
        share: Part of the excess residual power of the case that lies in this channel.
        band_hz: Frequency band that holds most of it.
        time_s: Interval that holds most of it.
        state_region: Interval by coordinate ("displacement", "velocity") of the first of `regions`.
        p_value: Probability of such an excess from noise alone, after correction for the number of cells looked at.
        kind: "force" where channels of the same coordinate agree with one another, "sensor" where they contradict each
            other, "undetermined" where there is only one, "simulator" for the share of step, integrator and soft friction.
        regions: Regions of the state space at the places the channel touches, the strongest first: their limits by
            coordinate, "share" of the squared force there, and mean "force". Where a named "effect" acts in a part of the state
            space only, those of that effect's force; where an unknown one does, as free runs tell, its limits; else those where
            the map of the missing force is significant.
    """

    channel: str
    dof: str
    share: float
    band_hz: tuple[float, float]
    time_s: tuple[float, float]
    state_region: dict[str, tuple[float, float]] = field(default_factory=dict)
    p_value: float = 1.0
    kind: str = "undetermined"
    regions: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True)
class Split:
    """A residual split into parts.

    Attributes:
        kind: What it is split by: "channel", "dof", "band_hz", "time_s", "displacement", "velocity", "after_reversal",
            "contact".
        of: What is split: "free run", a channel, or "missing force".
        dof: Degree of freedom or place; empty where it is all of them.
        cells: Names of the parts, or the edges between them (one more than parts).
        shares: Part of the excess power in each; they add up to one.
        p_values: Of no excess in each, after control of the false discovery rate.
        significant: Whether the excess of each is significant.
    """

    kind: str
    of: str
    dof: str
    cells: tuple[Any, ...]
    shares: tuple[float, ...]
    p_values: tuple[float, ...]
    significant: tuple[bool, ...]


@dataclass(frozen=True)
class Gap:
    """How far the discrepancy shrinks on one coordinate of the judging records.

    Attributes:
        metric: What the numbers are.
        before: Nominal model.
        parameters_only: Nominal parameters re-estimated within their uncertainty.
        after: With the named effects; for an unknown effect, with the nonparametric closure.
        noise_floor: What the stated noise alone leaves.
        closed: ``(before - after) / (before - noise_floor)``.
        closed_ci95: Block-bootstrap interval of `closed`.
        steps: The gap after each effect in turn: (name, gap).
        dof: Degree of freedom.
        free_runs: NRMSE of the position in free runs before and after, and what noise leaves of it, where the gap is one of the torque;
            else empty.
    """

    metric: str
    before: float
    parameters_only: float
    after: float
    noise_floor: float
    closed: float
    closed_ci95: tuple[float, float]
    steps: tuple[tuple[str, float], ...] = ()
    dof: str = ""
    free_runs: tuple[float, ...] = ()

    @property
    def over_noise(self) -> float:
        """What the nominal model misses over what noise alone leaves."""
        return self.before / max(self.noise_floor, 1e-12)


def widest_of(gaps: Sequence[Gap]) -> Gap:
    """The gap that stands furthest out of its noise."""
    return max(gaps, key=lambda gap: gap.over_noise)


def of_runs(gap: Gap) -> tuple[float, float, float]:
    """What free runs miss before and after, and what noise leaves of them: a gap's own numbers where it is one of free runs."""
    before, after, floor = gap.free_runs or (gap.before, gap.after, gap.noise_floor)
    return before, after, floor


@dataclass(frozen=True)
class Verdict:
    """The outcome of a diagnosis.

    Attributes:
        verdict: "effect", "none" or "unknown".
        named: Effects that explain the record; empty unless the verdict is "effect".
        ranking: Effects by probability.
        indistinguishable: Sets of names that the records cannot tell apart; of whole explanations, "gap + cubic_stiffness", where
            they cannot tell how many effects there are.
        locations: Where the residuals gather, by decreasing share.
        gap: The gap, of the degree of freedom where it is widest.
        gaps: The gap of every degree of freedom.
        probabilities: Probability of "effect", "none", "unknown".
        explanation: The verdict in plain words.
        warnings: What limits the verdict.
        closure: Name of the nonparametric closure behind `gap.after` when the verdict is "unknown".
        next_excitation: Excitation that would separate the rivals; empty where there are none.
        splits: Residuals by channel, band, time and state.
        seconds: Wall time.
        complete: Whether what is named leaves nothing but noise.
        remainder: What is left on the judging records: "nrmse", "over_noise" (times what noise leaves), "of_before" (part of the gap
            before), the "channel", "band_hz" and "time_s" that hold most of it in the records for identification, and the
            "free_force_gain": the part of what is left there that a free force, of what "free_force" names, would still take.
        nearest: Where nothing is named because something unknown is missing, the effects of the catalogue that come nearest.
        nearest_nominal: Nominal parameters as the explanation by `nearest` has them; empty where `nominal` and the gaps are of that one.
        nearest_left: What it leaves of each of `gaps`, beside `Gap.after`, which is what a free force leaves; empty likewise.
        nominal: Nominal parameters as the explanation behind `gap.after` has them.
        applied: What `jointbench apply` made of it in the user's own model: "changes", and "figures" before and after.
        settings: Thresholds that differ from their defaults, as `jointbench diagnose --settings` reads them.
    """

    verdict: VerdictKind
    named: tuple[NamedEffect, ...]
    ranking: tuple[Ranked, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    locations: tuple[Location, ...]
    gap: Gap
    gaps: tuple[Gap, ...]
    probabilities: dict[str, float]
    explanation: str
    warnings: tuple[str, ...] = ()
    closure: str = ""
    next_excitation: dict[str, Any] = field(default_factory=dict)
    splits: tuple[Split, ...] = ()
    seconds: float = 0.0
    complete: bool = False
    remainder: dict[str, Any] = field(default_factory=dict)
    nominal: tuple[NominalEstimate, ...] = ()
    nearest: tuple[NamedEffect, ...] = ()
    nearest_nominal: tuple[NominalEstimate, ...] = ()
    nearest_left: tuple[float, ...] = ()
    applied: dict[str, Any] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def left(self) -> str:
        """What is left, in words; empty where it is nothing but noise."""
        if self.complete or not self.remainder:
            return ""
        own = self.remainder
        noise = "" if own.get("over_noise") is None else f", {own['over_noise']:.3g} times what noise leaves"
        place = ""
        if own.get("channel"):
            (low, high), (first, last) = own["band_hz"], own["time_s"]
            place = (
                f"; most of it in '{own['channel']}', {low:.3g} to {high:.3g} Hz, {first:.3g} to {last:.3g} s"
            )
        free = ""
        if own.get("free_force_gain", 0.0) > 0.0:
            free = f" A free force of {own['free_force']} would still take {100.0 * own['free_force_gain']:.0f} % of its power."
        return f"Left on the judging records: NRMSE {own['nrmse']:.3g}{noise}{place}.{free}"

    def in_haste(self) -> Verdict:
        """The same with no name surer than even: its rivals were never tried, for lack of time."""
        return replace(
            self,
            named=tuple(replace(e, probability=min(e.probability, 0.5)) for e in self.named),
            ranking=tuple(replace(e, probability=min(e.probability, 0.5)) for e in self.ranking),
        )

    def timed(self, seconds: float) -> Verdict:
        """The verdict with its wall time [s]."""
        return replace(self, seconds=seconds)

    def to_json(self) -> dict[str, Any]:
        """Return the verdict as JSON values; numbers that are not finite become None."""
        return json_values(asdict(self))


class InSimulator(NamedTuple):
    """What was named, in the user's own simulator.

    Attributes:
        line: The outcome in a line.
        record: Judged coordinate to its motion (n,) in the first judging record.
    """

    line: str
    record: Mapping[str, NDArray[np.float64]]
