"""The rehearsal: effects put into the user's model size by size, sealed, diagnosed; from which size on each would be found."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.application.applying import Findings
from bench.discrepancy.case.case import Case
from bench.discrepancy.diagnosis import diagnose
from bench.discrepancy.model.model_units import in_model_units
from bench.discrepancy.rehearsal.placing import EffectSite, sites
from bench.discrepancy.rehearsal.truth import ModelLaboratory
from bench.discrepancy.verdict import NamedEffect, Verdict
from bench.documents.loading import load_document
from bench.errors import BenchError, ParameterError
from bench.files import json_values, write_text
from bench.progress import ShowProgress

STORE = "rehearsal.json"
"""Name of the file that holds what is done."""


@dataclass(frozen=True)
class RehearsalSettings:
    """Numbers of `bench.discrepancy.rehearsal.rehearsing`."""

    sizes: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01)
    """Parts of a response's standard deviation by which an effect changes it: from what nobody overlooks to what a good model is off
    by."""


SETTINGS = RehearsalSettings()


@dataclass(frozen=True)
class Outcome:
    """One sealed case.

    Attributes:
        effect: The effect that was put in.
        where: Its place.
        size: Part of a response by which it changes it.
        amplitude: Its first parameter, with name and unit.
        verdict: Kind of the verdict; "refused" where there was none.
        named: Effects with their places.
        found: Whether the effect is among them, itself or in the set that the records cannot tell from it.
        before: NRMSE of the nominal model on the judging records.
        after: What is left of it.
        note: Why there is no verdict.
    """

    effect: str
    where: str
    size: float
    amplitude: str
    verdict: str
    named: tuple[str, ...] = ()
    found: bool = False
    before: float = float("nan")
    after: float = float("nan")
    note: str = ""


@dataclass(frozen=True)
class Rehearsal:
    """What is done of a rehearsal.

    Attributes:
        case: Name of the case.
        sizes: Sizes from the largest on.
        outcomes: Sealed cases, effect by effect.
        fingerprint: Of everything that decides them.
    """

    case: str
    sizes: tuple[float, ...]
    outcomes: tuple[Outcome, ...] = ()
    fingerprint: str = ""
    false_alarms: tuple[str, ...] = field(default=())

    @property
    def labels(self) -> list[tuple[str, str]]:
        """Effects and places in their order."""
        return list(dict.fromkeys((o.effect, o.where) for o in self.outcomes))

    def of(self, label: tuple[str, str]) -> list[Outcome]:
        """Outcomes of an effect at a place."""
        return [o for o in self.outcomes if (o.effect, o.where) == label]

    def threshold(self, label: tuple[str, str]) -> Outcome | None:
        """The smallest size from which on an effect is found at every larger one; None where not even the largest is."""
        last = None
        for outcome in self.of(label):
            if not outcome.found:
                break
            last = outcome
        return last

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        rows = []
        for label in self.labels:
            least = self.threshold(label)
            rows.append({
                "effect": label[0], "where": label[1], "found_from": least.size if least else None,
                "amplitude": least.amplitude if least else "",
            })  # fmt: skip
        return {
            "case": self.case, "sizes": list(self.sizes), "fingerprint": self.fingerprint, "rows": rows,
            "outcomes": [asdict(o) for o in self.outcomes], "false_alarms": list(self.false_alarms),
        }  # fmt: skip

    @classmethod
    def read(cls, path: Path) -> Rehearsal:
        """Read what was done.

        Raises:
            FileFormatError: It is no JSON.
            ParameterError: It is no rehearsal.
        """
        document = load_document(path)
        try:
            outcomes = tuple(
                Outcome(**o | {"named": tuple(o["named"]), "before": _float(o["before"]), "after": _float(o["after"])})
                for o in document["outcomes"]
            )  # fmt: skip
            return cls(
                document["case"], tuple(document["sizes"]), outcomes, document["fingerprint"], tuple(document["false_alarms"])
            )  # fmt: skip
        except (KeyError, TypeError) as error:
            raise ParameterError(
                f"'{path}' is no rehearsal ({error}); remove it, or give another folder"
            ) from None


def _float(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def rehearse(
    case: Case,
    folder: Path,
    *,
    effects: Sequence[str] = (),
    sizes: Sequence[float] = SETTINGS.sizes,
    seed: int = 0,
    again: bool = False,
    progress: ShowProgress = lambda text, share: None,
) -> Rehearsal:
    """Rehearse a case; what is done is kept, so that a rehearsal that was stopped goes on where it was.

    Every effect is tried from the largest size on until one is not found. Before them all, the model with nothing put in is
    diagnosed: what is named then is a false alarm.

    Args:
        case: Nominal model, channels, and records whose commands are played.
        folder: Where `rehearsal.json` is kept.
        effects: ``NAME`` or ``NAME:PLACE``; one of each family where empty.
        sizes: Parts of a response's standard deviation.
        seed: Of true parameters and noise.
        again: Forget what was done.
        progress: Called with what is being done and the share that is.

    Raises:
        ParameterError: The folder holds another rehearsal, or a size is none.
        ModelError: The model is none that a laboratory can be made of.
    """
    if not sizes or min(sizes) <= 0.0 or max(sizes) > 2.0:
        raise ParameterError(f"sizes {tuple(sizes)} came; parts of a response between 0 and 2 are expected")
    ordered = tuple(sorted(set(sizes), reverse=True))
    case, _ = in_model_units(case)
    laboratory = ModelLaboratory.of(case)
    print_of = _fingerprint(laboratory, ordered, seed)
    done = Rehearsal(case.name, ordered, fingerprint=print_of)
    store = folder / STORE
    if store.exists() and not again:
        done = Rehearsal.read(store)
        if done.fingerprint != print_of:
            raise ParameterError(
                f"'{store}' is a rehearsal of other records, sizes or another model; --force begins anew, or give another folder"
            )
    progress("the nominal model", 0.0)
    base = laboratory.measured(Findings(()), np.random.default_rng((seed, 1)))
    chosen = sites(base, effects, articulated=laboratory.articulated)
    kept = {(o.effect, o.where, o.size): o for o in done.outcomes}
    outcomes: list[Outcome] = []

    def keep(more: Sequence[Outcome] = (), alarms: tuple[str, ...] = done.false_alarms) -> Rehearsal:
        others = [o for key, o in kept.items() if key not in {(x.effect, x.where, x.size) for x in more}]
        now = Rehearsal(case.name, ordered, (*others, *more), print_of, alarms)
        text = json.dumps(json_values(now.to_json()), indent=1, ensure_ascii=False, allow_nan=False)
        write_text(store, text + "\n")
        return now

    alarms = done.false_alarms
    if not kept:
        progress("nothing put in", 0.0)
        alarms = _alarms(laboratory, seed)
        keep(alarms=alarms)
    for k, site in enumerate(chosen):
        for size in ordered:
            share = (k + ordered.index(size) / len(ordered)) / len(chosen)
            outcome = kept.get((site.name, site.where, size))
            if outcome is None:
                progress(f"{site.label} at {100 * size:g} %", share)
                outcome = _sealed(laboratory, site, size, seed + k)
            outcomes.append(outcome)
            keep(outcomes, alarms)
            if not outcome.found:
                break
    return Rehearsal(case.name, ordered, tuple(outcomes), print_of, alarms)


def _alarms(laboratory: ModelLaboratory, seed: int) -> tuple[str, ...]:
    """What is named where nothing is missing."""
    rng = np.random.default_rng((seed, 2))
    sealed = laboratory.measured(Findings((), laboratory.drawn(rng)), rng)
    try:
        return _names(diagnose(sealed).verdict)
    except BenchError as error:
        return (f"refused: {error}",)


def _sealed(laboratory: ModelLaboratory, site: EffectSite, size: float, seed: int) -> Outcome:
    """Put an effect in, and diagnose what is measured then."""
    effect = site.at(size)
    if effect is None:
        note = f"changes no response by {100 * size:g} % within these motions"
        return Outcome(site.name, site.where, size, "", "out of reach", note=note)
    rng = np.random.default_rng((seed, round(1e4 * size)))
    told = _amplitude(effect)
    try:
        sealed = laboratory.measured(Findings((effect,), laboratory.drawn(rng)), rng)
        verdict = diagnose(sealed).verdict
    except BenchError as error:
        return Outcome(site.name, site.where, size, told, "refused", note=" ".join(str(error).split()))
    gap = verdict.gap
    return Outcome(
        site.name, site.where, size, told, verdict.verdict, _names(verdict), is_found(verdict, site), gap.before, gap.after
    )  # fmt: skip


def is_found(verdict: Verdict, site: EffectSite) -> bool:
    """Whether a verdict names an effect at its place, or one of the set that the records cannot tell from it."""
    for effect in verdict.named:
        alike = {effect.name} | {name for group in verdict.indistinguishable if effect.name in group for name in group}  # fmt: skip
        if site.name in alike and ({effect.where, effect.channel} & site.aliases or not effect.where):
            return verdict.verdict == "effect"
    return False


def _names(verdict: Verdict) -> tuple[str, ...]:
    return tuple(f"{e.name}:{e.where or e.channel}" for e in verdict.named)


def _amplitude(effect: NamedEffect) -> str:
    name, first = next(iter(effect.parameters.items()))
    return f"{name} {first.value:.3g} {first.unit}".rstrip()


def _fingerprint(laboratory: ModelLaboratory, sizes: Sequence[float], seed: int) -> str:
    """Of the model, what is believed of it, the commands and the options."""
    case = laboratory.case
    whole = hashlib.sha256(laboratory.path.read_bytes())
    whole.update(
        repr((case.parameters, case.channels, sorted(case.options.items()), tuple(sizes), seed)).encode()
    )
    inputs = [c.name for c in case.channels if c.role != "response"]
    for record in (*case.identification, *case.validation):
        whole.update(f"{record.name} {record.step!r}".encode())
        for name in inputs:
            whole.update(np.ascontiguousarray(record.values[name]).tobytes())
    return whole.hexdigest()[:16]
