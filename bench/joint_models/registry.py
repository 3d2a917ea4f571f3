"""The kinds of models that a joint can be identified as, by name.

A kind is a function from motions and restoring forces to a law of the bench with its parameters. To add one, give it a line in
`KINDS`: the commands `identify`, `swap`, `compare` and `export` then know it, if `bench.laws.find_law` finds its law by name and header.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.errors import IdentificationError, UnknownNameError
from bench.identification.fit_data import nmse_percent
from bench.identification.memory import fit_memory
from bench.identification.network import fit_network
from bench.identification.parametric import ComponentRecord, fit_law
from bench.identification.polynomial import fit_polynomial
from bench.identification.validity_range import ValidityRange
from bench.joint_models.scales import starts_of
from bench.laws.base import ForceLaw
from bench.laws.evaluate import evaluate
from bench.laws.registry import LAWS, find_law


@dataclass(frozen=True)
class Settings:
    """How a joint is identified.

    Attributes:
        order: Highest power of each state of a polynomial; 3 is the dissertation's (Tasbihgoo 2006, section 4.1.3).
        hidden: Hidden units of a network; 30 is that of the published one (appendix A).
        laws: Laws that are fitted for the kind "law"; the one that predicts the held-out samples best is kept.
        starts: Random starts of a network or a law.
        hold_out: Share that is left for judging where no other records are given.
        stretches: Stretches of a record whose ends are held out.
        seed: Seed of the starts.
    """

    order: int = 3
    hidden: int = 30
    laws: tuple[str, ...] = ()
    starts: int = 8
    hold_out: float = 0.2
    stretches: int = 5
    seed: int = 0


@dataclass(frozen=True)
class Fitted:
    """An identified joint.

    Attributes:
        law: Its law.
        theta: Header and parameters (n_theta,).
        range: Range of the states that it was identified from.
        report: How the fit went, JSON values.
    """

    law: ForceLaw
    theta: Array = field(repr=False)
    range: ValidityRange | None = None
    report: Mapping[str, Any] = field(default_factory=dict)


FitFunction = Callable[[Sequence[ComponentRecord], Settings, np.random.Generator], Fitted]


@dataclass(frozen=True)
class JointKind:
    """A kind of model.

    Attributes:
        summary: What it is, for the command line.
        fit: Its identification.
        memory: Whether its force depends on more than the present state.
    """

    summary: str
    fit: FitFunction
    memory: bool = False


def stacked(motions: Sequence[ComponentRecord]) -> tuple[Array, Array]:
    """States (n, 2 k) and forces (n, k) of all records, one after the other."""
    states = [np.concatenate([m.displacement, m.velocity], axis=1) for m in motions]
    return np.concatenate(states), np.concatenate([m.force for m in motions])


def _polynomial(motions: Sequence[ComponentRecord], settings: Settings, _: np.random.Generator) -> Fitted:
    model = fit_polynomial(*stacked(motions), orders=settings.order)
    report = {
        "terms": model.report.n_terms,
        "rank": model.report.rank,
        "condition_number": model.report.condition_number,
    }
    return Fitted(model.law, model.theta, model.range, report)


def _network(motions: Sequence[ComponentRecord], settings: Settings, rng: np.random.Generator) -> Fitted:
    model = fit_network(*stacked(motions), n_hidden=settings.hidden, n_restarts=settings.starts, rng=rng)
    report = {
        "weights": model.report.n_weights,
        "effective_parameters": model.report.effective_parameters,
        "stopped": model.report.stopped,
    }
    return Fitted(model.law, model.theta, model.range, report)


def _law(motions: Sequence[ComponentRecord], settings: Settings, rng: np.random.Generator) -> Fitted:
    k = motions[0].force.shape[1]
    suited = [name for name, law in LAWS.items() if law.n_coordinates == k and not law.n_inputs]
    if not settings.laws:
        raise UnknownNameError("law; name one or several with --law, as --law gap: ''", "", suited)
    best: tuple[float, Fitted] | None = None
    for name in settings.laws:
        if name not in suited:
            raise UnknownNameError(f"law of {k} coordinate(s)", name, suited)
        law = find_law(name)
        start, search = starts_of(law, motions)
        fitted = fit_law(law, motions, start=start, search=search, starts=settings.starts, rng=rng)
        report = {"parameters": fitted.parameters, "std": fitted.std, "nrmse": fitted.nrmse}
        if best is None or fitted.nrmse < best[0]:
            range_ = ValidityRange.of(stacked(motions)[0])
            best = fitted.nrmse, Fitted(law, fitted.theta, range_, report)
    assert best is not None
    return best[1]


def _memory(motions: Sequence[ComponentRecord], _: Settings, __: np.random.Generator) -> Fitted:
    time = np.concatenate([m.time - m.time[0] for m in motions])
    model = fit_memory(*stacked(motions), time=time)
    return Fitted(model.law, model.theta, model.range, asdict(model.report))


KINDS: Mapping[str, JointKind] = MappingProxyType(
    {
        "polynomial": JointKind("Chebyshev polynomial of displacements and velocities", _polynomial),
        "network": JointKind("tanh network of displacements and velocities", _network),
        "law": JointKind(
            "a force law of the bench, hidden states included (name it with --law)", _law, memory=True
        ),
        "memory": JointKind(
            "joint that remembers: slip, springs and dampers that are passive", _memory, memory=True
        ),
    }
)
"""Every kind by its name."""


def identify(kind: str, motions: Sequence[ComponentRecord], settings: Settings | None = None) -> Fitted:
    """Identify a joint.

    Args:
        kind: Name in `KINDS`.
        motions: Records of motion and restoring force.
        settings: How.

    Raises:
        UnknownNameError: No such kind or law.
        IdentificationError: The records do not determine it.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind of joint model", kind, KINDS)
    if not motions:
        raise IdentificationError("no records came; at least one record of motion and force is expected")
    own = settings or Settings()
    return KINDS[kind].fit(motions, own, np.random.default_rng(own.seed))


def scores(
    fitted: Fitted, motions: Sequence[ComponentRecord], where: Sequence[NDArray[np.bool_]] | None = None
) -> tuple[float, ...]:
    """NMSE of the forces of a joint along records, each coordinate [%].

    Args:
        fitted: The joint.
        motions: The records; hidden states start where they do.
        where: Samples of every record that count; all where None.
    """
    chosen = [np.ones(len(m.time), dtype=bool) for m in motions] if where is None else where
    predicted = [evaluate(fitted.law, fitted.theta, m.time, m.displacement, m.velocity)[0] for m in motions]
    true = np.concatenate([m.force[mask] for m, mask in zip(motions, chosen, strict=True)])
    return nmse_percent(true, np.concatenate([f[mask] for f, mask in zip(predicted, chosen, strict=True)]))


def judging_samples(
    kind: str, motions: Sequence[ComponentRecord], settings: Settings
) -> list[NDArray[np.bool_]]:
    """Samples of every record that are left for judging: the end of each of five stretches, or of the whole with a memory.

    Stretches, since a sweep ends at frequencies that its beginning never had; with a memory a record is not cut, since its state would
    be lost.
    """
    masks = []
    for motion in motions:
        n = len(motion.time)
        parts = 1 if KINDS[kind].memory else settings.stretches
        place = (np.arange(n) * parts / n) % 1.0
        masks.append(place >= 1.0 - settings.hold_out)
    return masks


def without_masked(
    motions: Sequence[ComponentRecord], masks: Sequence[NDArray[np.bool_]]
) -> list[ComponentRecord]:
    """Records without the samples of the masks."""
    return [
        ComponentRecord(*(column[~mask] for column in motion))
        for motion, mask in zip(motions, masks, strict=True)
    ]
