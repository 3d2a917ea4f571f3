"""A reduced-order joint as a deck: the network's weights on cards.

The network ``r = W2 tanh(W1 (q, v) + b1) + b2`` becomes a chain of linear relations between virtual points, closed by two
sets of tabulated loads (stages 1 to 5):

1. the relative states are the components of a virtual grid, tied by MPC: ``u_p = u_2 - u_1``;
2. one scalar point a neuron holds the input of its tanh: DMIG terms of the added stiffness (weights of q) and damping
   (weights of v), SLOAD for its bias;
3. another holds the output: NOLIN1 with a table of tanh;
4. one scalar point a component holds the restoring force: DMIG terms for its weights, SLOAD for its bias;
5. NOLIN1 with an identity table puts minus that force on the virtual grid, whence the MPC carries it to both bodies.

Sign: r is positive when it opposes positive ``u_2 - u_1`` (second body less first), as everywhere in the bench. The
dissertation's eqs. 5.4 and 5.45 write the relative state the other way round with the opposite force; its deck is as here.

References:
    Tasbihgoo 2006, section 5.1.2, eqs. 5.14-5.46, and appendix B.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.errors import ParameterError
from bench.laws.network import NetworkWeights, fold_scaling
from bench.nastran.bulk import Format, deck_text, write_deck
from bench.nastran.cards import (
    DmigColumn,
    DmigHeader,
    Grid,
    Lseq,
    Mpc,
    Nolin1,
    ScalarPoints,
    Sload,
    Tabled1,
    Tload1,
)
from bench.nastran.raw_card import Card
from bench.nastran.tanh_table import tanh_points
from bench.rig import Element


@dataclass(frozen=True)
class Units:
    """The units of a deck; angles are in radians and time in seconds in all of them."""

    name: str
    length: str
    force: str
    metres: float
    """Metres a unit of length."""
    newtons: float
    """Newtons a unit of force."""


SI = Units("SI", "m", "N", 1.0, 1.0)
"""Decks in metre, newton and kilogram."""
INCH_POUND = Units("inch-pound", "in", "lbf", 0.0254, 4.4482216152605)
"""Decks in inch and pound-force; masses in lbf s²/in."""


@dataclass(frozen=True)
class Numbering:
    """Identification numbers in a deck; the defaults are the dissertation's.

    Attributes:
        relative: Virtual grid that holds the relative states.
        inputs: First scalar point of the tanh inputs.
        hidden: First scalar point of the tanh outputs.
        outputs: First scalar point of the restoring forces.
        stiffness: Name of the matrix added to the stiffness (case control K2PP).
        damping: Name of the matrix added to the damping (case control B2PP).
        nonlinear: Set of the NOLIN1 cards (case control NONLINEAR).
        mpc: Set of the MPC cards.
        bias: Set of the static loads.
        sequence: Load sequence that makes them dynamic (case control LOADSET).
        excitation: Name of that dynamic load to TLOAD1.
        dynamic: TLOAD1, to be named by the DLOAD card.
        identity: Table of the identity.
        constant: Table of the constant 1.
        tanh: Table of tanh.
    """

    relative: int = 100
    inputs: int = 1001
    hidden: int = 2001
    outputs: int = 3001
    stiffness: str = "STIF"
    damping: str = "DAMP"
    nonlinear: int = 5
    mpc: int = 1
    bias: int = 501
    sequence: int = 601
    excitation: int = 203
    dynamic: int = 103
    identity: int = 101
    constant: int = 103
    tanh: int = 112

    def points(self, n_hidden: int, n_outputs: int) -> tuple[range, range, range]:
        """Numbers of the scalar points of inputs, hidden outputs and forces.

        Raises:
            ParameterError: The ranges overlap each other or the virtual grid.
        """
        ranges = (
            range(self.inputs, self.inputs + n_hidden),
            range(self.hidden, self.hidden + n_hidden),
            range(self.outputs, self.outputs + n_outputs),
        )
        numbers = [self.relative, *(number for points in ranges for number in points)]
        if len(set(numbers)) < len(numbers) or min(numbers) < 1:
            raise ParameterError(
                f"the points of {n_hidden} hidden units and {n_outputs} outputs overlap (grid {self.relative}, from "
                f"{self.inputs}, {self.hidden} and {self.outputs}); spread them with another Numbering"
            )
        return ranges


def network_weights(network: Element | NetworkWeights) -> NetworkWeights:
    """The weights of a network element, in SI units.

    Raises:
        ParameterError: The element holds another law, or the arrays do not fit together.
    """
    if isinstance(network, Element):
        if network.law.name != "network":
            raise ParameterError(
                f"element '{network.name}' holds the law '{network.law.name}'; only a network can be written as a deck "
                "(identify one with bench.reduced_joint(model='network'))"
            )
        if len(network.law.header) > 2:
            raise ParameterError(
                f"element '{network.name}' is a network that is held at the edge of its data; only one that is its weights everywhere can "
                "be written so: identify it with bounded=False"
            )
        k, width = (int(entry) for entry in network.law.header)
        parts = np.split(network.theta[2:], np.cumsum([2 * k * width, width, k * width]))
        return NetworkWeights(parts[0].reshape(width, 2 * k), parts[1], parts[2].reshape(k, width), parts[3])
    weights = NetworkWeights(*(np.asarray(part, dtype=float) for part in network))
    shapes = [part.shape for part in weights]
    width, k = weights.b1.size, weights.b2.size
    if shapes != [(width, 2 * k), (width,), (k, width), (k,)] or not all(
        np.all(np.isfinite(part)) for part in weights
    ):
        raise ParameterError(
            f"W1, b1, W2, b2 have the shapes {shapes}; finite (l, 2 k), (l,), (k, l), (k,) are expected"
        )
    return weights


def _check_components(components: Sequence[int], n_joints: int) -> tuple[int, ...]:
    chosen = tuple(int(component) for component in components)
    if len(chosen) != n_joints or len(set(chosen)) != n_joints or not set(chosen) <= set(range(1, 7)):
        raise ParameterError(
            f"components {chosen} came for a network on {n_joints} joint(s); as many different ones from 1 to 6 are expected "
            "(1 to 3 translations, 4 to 6 rotations)"
        )
    return chosen


def unit_scales(components: Sequence[int], units: Units) -> tuple[list[float], list[float]]:
    """SI values of one deck unit of each input (displacements, then velocities) and each output."""
    lengths = [units.metres if component <= 3 else 1.0 for component in components]
    forces = [units.newtons * (1.0 if component <= 3 else units.metres) for component in components]
    return lengths * 2, forces


def network_cards(
    network: Element | NetworkWeights,
    *,
    components: Sequence[int],
    bodies: tuple[int, int] | None = None,
    units: Units = SI,
    numbering: Numbering | None = None,
    table_points: int = 2001,
    width: int = 16,
) -> list[Card | str]:
    """The cards and comments of a network's deck, to be included in a Nastran model.

    Args:
        network: A network element, or its weights in SI units.
        components: Component of the virtual grid for each joint of the network, 1 to 3 translations, 4 to 6 rotations.
        bodies: Grids of the first and the second body; MPC cards tie the virtual grid to them. Without them the deck
            holds none, and the model's own must.
        units: Units of the deck.
        numbering: Identification numbers; the dissertation's by default.
        table_points: Points of the tanh table.
        width: Characters a number will have (8 or 16); the table's values are those at the rounded abscissae.

    Raises:
        ParameterError: Components, shapes or numbers do not fit.
    """
    weights = network_weights(network)
    chosen = _check_components(components, weights.b2.size)
    ids = numbering or Numbering()
    inputs, hidden, outputs = ids.points(weights.b1.size, weights.b2.size)
    lengths, forces = unit_scales(chosen, units)
    own = fold_scaling(weights, 0.0, 1.0 / np.array(lengths), output_scale=1.0 / np.array(forces))
    cards: list[Card | str] = [_comment(weights, chosen, units, ids)]
    cards.append(Grid(ids.relative, constrained="".join(str(c) for c in range(1, 7) if c not in chosen)))
    if bodies is not None:
        first, second = bodies
        terms = [((first, c, 1.0), (ids.relative, c, 1.0), (second, c, -1.0)) for c in chosen]
        cards += [
            f"relative states: u{ids.relative} = u{second} - u{first}",
            *(Mpc(ids.mpc, term) for term in terms),
        ]
    cards += ["tanh inputs, tanh outputs, restoring forces"]
    cards += [ScalarPoints(tuple(points)) for points in (inputs, hidden, outputs)]
    cards += ["biases b1 and b2", Lseq(ids.sequence, ids.excitation, ids.bias)]
    cards += [
        Tload1(ids.dynamic, ids.excitation, ids.constant),
        Tabled1(ids.constant, ((-1.0, 1.0), (1.0, 1.0))),
    ]
    loads = [*zip(inputs, own.b1.tolist(), strict=True), *zip(outputs, own.b2.tolist(), strict=True)]
    cards += [Sload(ids.bias, (load,)) for load in loads]
    cards += _matrices(own, chosen, ids, (inputs, hidden, outputs))
    cards += ["tanh"]
    cards += [
        Nolin1(ids.nonlinear, after, 0, 1.0, before, 0, ids.tanh)
        for before, after in zip(inputs, hidden, strict=True)
    ]
    cards += [Tabled1(ids.tanh, tanh_points(table_points, width))]
    cards += ["restoring forces on the relative states, minus r"]
    cards += [
        Nolin1(ids.nonlinear, ids.relative, c, -1.0, point, 0, ids.identity)
        for c, point in zip(chosen, outputs, strict=True)
    ]
    return [*cards, Tabled1(ids.identity, ((-1.0, -1.0), (1.0, 1.0)))]


def _comment(weights: NetworkWeights, components: tuple[int, ...], units: Units, ids: Numbering) -> str:
    return "\n".join(
        [
            f"Reduced-order joint: network with {weights.W1.shape[1]} inputs, {weights.b1.size} tanh units, "
            f"{weights.b2.size} output(s)",
            f"Units: {units.length}, rad, s, {units.force}, {units.force} {units.length} ({units.name})",
            f"Components of grid {ids.relative}: {', '.join(map(str, components))}",
            f"Case control: K2PP={ids.stiffness} B2PP={ids.damping} NONLINEAR={ids.nonlinear} LOADSET={ids.sequence} "
            f"MPC={ids.mpc}",
            f"DLOAD card: name TLOAD1 {ids.dynamic} with factor 1.0",
        ]
    )


def _matrices(
    own: NetworkWeights, components: tuple[int, ...], ids: Numbering, points: tuple[range, range, range]
) -> list[Card | str]:
    """DMIG cards, each column whole: Nastran asks for one logical entry a column."""
    inputs, hidden, outputs = points
    k = len(components)
    cards: list[Card | str] = [
        "stiffness: weights of the displacements (W1), and W2",
        DmigHeader(ids.stiffness),
    ]
    for i, component in enumerate(components):
        terms = [(point, 0, -w) for point, w in zip(inputs, own.W1[:, i].tolist(), strict=True)]
        cards.append(DmigColumn(ids.stiffness, ids.relative, component, tuple(terms)))
    cards += [DmigColumn(ids.stiffness, point, 0, ((point, 0, 1.0),)) for point in inputs]
    for j, point in enumerate(hidden):
        terms = [(output, 0, -w) for output, w in zip(outputs, own.W2[:, j].tolist(), strict=True)]
        cards.append(DmigColumn(ids.stiffness, point, 0, ((point, 0, 1.0), *terms)))
    cards += [DmigColumn(ids.stiffness, point, 0, ((point, 0, 1.0),)) for point in outputs]
    cards += ["damping: weights of the velocities (W1)", DmigHeader(ids.damping)]
    for i, component in enumerate(components):
        terms = [(point, 0, -w) for point, w in zip(inputs, own.W1[:, k + i].tolist(), strict=True)]
        cards.append(DmigColumn(ids.damping, ids.relative, component, tuple(terms)))
    return cards


def network_text(network: Element | NetworkWeights, *, form: Format = "large", **settings: object) -> str:
    """The text of a network's deck.

    Args:
        network: A network element, or its weights in SI units.
        form: "large" (10 to 15 digits), "small" (3 to 7) or "free" (as large, with commas).
        **settings: As of `network_cards`; `components` must be given.

    Raises:
        ParameterError: As `network_cards`.
    """
    return deck_text(network_cards(network, width=8 if form == "small" else 16, **settings), form=form)  # type: ignore[arg-type]


def write_network(
    path: str | Path, network: Element | NetworkWeights, *, form: Format = "large", **settings: object
) -> None:
    """Write a network's deck, whole or not at all; arguments as of `network_text`."""
    write_deck(path, network_cards(network, width=8 if form == "small" else 16, **settings), form=form)  # type: ignore[arg-type]
