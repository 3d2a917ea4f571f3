"""A network read back from the cards of a deck, whatever numbers and layout they have.

Reading follows the cards' relations, not their numbers: restoring forces are the points read by NOLIN1 loads on a grid, hidden
points those that other NOLIN1 cards load. Scale factors, table slopes and diagonal terms other than 1 are divided out. The
layout of the dissertation's deck (one term a card, columns repeated) and that of `bench.nastran.network_deck` (a
column a card) read alike.

References:
    Tasbihgoo 2006, section 5.1.2, eqs. 5.14-5.46, and appendix B.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.errors import FileFormatError
from bench.laws.network import NetworkWeights, fold_scaling, network_law
from bench.nastran.bulk import Deck, read_deck
from bench.nastran.cards import DmigColumn, DmigHeader, Mpc, Nolin1, ScalarPoints, Sload, Tabled1
from bench.nastran.network_deck import SI, Numbering, Units, unit_scales
from bench.nastran.tanh_table import table_error
from bench.rig import Element

Freedom = tuple[int, int]
"""Point and component; a scalar point's component is 0."""


class DeckNetwork(NamedTuple):
    """A network read from a deck."""

    weights: NetworkWeights
    """In SI units."""
    components: tuple[int, ...]
    """Components of the virtual grid, 1 to 3 translations and 4 to 6 rotations, in the order of the network's joints."""
    bodies: tuple[int, int] | None
    """Grids that the joint connects; None where no MPC ties the virtual grid."""
    tanh_error: float | None
    """Largest deviation of the deck's table from tanh; None where the deck does not hold that table."""

    def element(self, joints: Sequence[str], *, name: str = "joint") -> Element:
        """The network as an element on these joints or tendons, in the order of `components`."""
        n_hidden, n_states = self.weights.W1.shape
        law = network_law(n_states // 2, n_hidden)
        return Element(law, tuple(joints), law.theta(self.weights.flat()), name=name)


def read_network(
    deck: str | Path | Deck, *, units: Units = SI, numbering: Numbering | None = None
) -> DeckNetwork:
    """Read a network back from a deck.

    Args:
        deck: A file, or a deck that was read already.
        units: Units of the deck.
        numbering: Names of the two matrices and numbers of the sets of static and nonlinear loads; the points' numbers are
            not used.

    Returns:
        The network in SI units.

    Raises:
        FileFormatError: A card is malformed, or the cards do not make up a network; says what is missing.
    """
    cards = deck if isinstance(deck, Deck) else read_deck(deck)
    return _Reader(cards, numbering or Numbering()).network(units)


class _Reader:
    """The relations of a deck's cards, gathered for one network."""

    def __init__(self, deck: Deck, ids: Numbering) -> None:
        self.ids = ids
        self.scalars = {point for card in deck.of(ScalarPoints) for point in card.ids}
        self.stiffness = self._matrix(deck, ids.stiffness)
        self.damping = self._matrix(deck, ids.damping)
        self.biases: dict[int, float] = {}
        for card in deck.of(Sload):
            if card.sid == ids.bias:
                for point, load in card.loads:
                    self.biases[point] = self.biases.get(point, 0.0) + load
        self.loads = [card for card in deck.of(Nolin1) if card.sid == ids.nonlinear]
        self.tables = {card.id: card for card in deck.of(Tabled1)}
        self.relations = deck.of(Mpc)
        if not self.loads:
            raise FileFormatError(
                f"the deck holds no NOLIN1 of set {ids.nonlinear}; give the set of the network's in `numbering`"
            )

    def _matrix(self, deck: Deck, name: str) -> dict[tuple[Freedom, Freedom], float]:
        """Terms by (row, column); a scalar point's component counts as 0."""
        if name not in {card.matrix for card in deck.of(DmigHeader)}:
            known = sorted({card.matrix for card in deck.of(DmigHeader)})
            raise FileFormatError(f"the deck holds no header of a DMIG '{name}'; it holds {known or 'none'}")
        terms: dict[tuple[Freedom, Freedom], float] = {}
        for card in deck.of(DmigColumn):
            if card.matrix != name:
                continue
            for point, component, value in card.terms:
                key = (self._freedom(point, component), self._freedom(card.point, card.component))
                if key in terms:
                    raise FileFormatError(
                        f"DMIG {name} gives the term of row {key[0]} and column {key[1]} twice"
                    )
                terms[key] = value
        return terms

    def _freedom(self, point: int, component: int) -> Freedom:
        return (point, 0 if point in self.scalars else component)

    def network(self, units: Units) -> DeckNetwork:
        """Follow the relations from the forces back to the relative states."""
        outer = sorted(
            (load for load in self.loads if load.loaded not in self.scalars),
            key=lambda load: load.loaded_component,
        )
        inner = {load.loaded: load for load in self.loads if load.loaded in self.scalars}
        grids = {load.loaded for load in outer}
        if len(grids) != 1 or not inner:
            raise FileFormatError(
                f"NOLIN1 of set {self.ids.nonlinear} load the grids {sorted(grids)} and {len(inner)} scalar points; one "
                "virtual grid and at least one hidden unit are expected (its SPOINT and NOLIN1 cards must be in the deck)"
            )
        grid = grids.pop()
        components = tuple(load.loaded_component for load in outer)
        outputs = [load.read_from for load in outer]
        hidden = sorted(inner)
        inputs = [inner[point].read_from for point in hidden]
        states = [(grid, component) for component in components]
        first = [
            [
                self._term(matrix, point, state)
                for matrix in (self.stiffness, self.damping)
                for state in states
            ]
            for point in inputs
        ]
        gains = np.array([-load.scale * self._slope(load.table) for load in outer])
        units_out = np.array([inner[p].scale / self._diagonal(p) for p in hidden])
        second = np.array([[self._term(self.stiffness, point, (h, 0)) for h in hidden] for point in outputs])
        weights = NetworkWeights(
            np.array(first),
            np.array([self.biases.get(point, 0.0) / self._diagonal(point) for point in inputs]),
            gains[:, None] * second * units_out,
            gains * np.array([self.biases.get(point, 0.0) / self._diagonal(point) for point in outputs]),
        )
        lengths, forces = unit_scales(components, units)
        return DeckNetwork(
            fold_scaling(weights, 0.0, np.array(lengths), output_scale=np.array(forces)),
            components,
            self._bodies(grid),
            self._tanh_error({load.table for load in inner.values()}),
        )

    def _diagonal(self, point: int) -> float:
        value = self.stiffness.get(((point, 0), (point, 0)), 0.0)
        if value == 0.0:
            raise FileFormatError(
                f"DMIG {self.ids.stiffness} has no diagonal term for scalar point {point}, which the network needs"
            )
        return value

    def _term(
        self,
        matrix: dict[tuple[Freedom, Freedom], float],
        point: int,
        column: Freedom,
    ) -> float:
        return -matrix.get(((point, 0), column), 0.0) / self._diagonal(point)

    def _slope(self, table: int) -> float:
        """Slope of a table that should be a straight line through the origin; 1 where the deck does not hold it."""
        if table not in self.tables:
            return 1.0
        x, y = np.array(self.tables[table].points).T
        slope = (y[-1] - y[0]) / (x[-1] - x[0])
        if not np.allclose(y, slope * x, rtol=1e-6, atol=1e-6 * np.max(np.abs(y))):
            raise FileFormatError(
                f"TABLED1 {table}, through which the restoring forces are applied, is no straight line through the origin"
            )
        return float(slope)

    def _tanh_error(self, tables: set[int]) -> float | None:
        present = [self.tables[table] for table in tables if table in self.tables]
        if not present:
            return None
        error = max(table_error(table.points) for table in present)
        if error > 0.05:
            raise FileFormatError(
                f"the hidden units' table {sorted(tables)} deviates from tanh by {error:.2g}; the network law has "
                "tanh units only"
            )
        return error

    def _bodies(self, grid: int) -> tuple[int, int] | None:
        """First and second body of the relations ``u_1 + u_p - u_2 = 0`` (of either sign)."""
        for relation in self.relations:
            own = [coefficient for point, _, coefficient in relation.terms if point == grid]
            others = [(point, coefficient) for point, _, coefficient in relation.terms if point != grid]
            if len(own) == 1 and len(others) == 2:
                second, first = sorted(others, key=lambda term: term[1] / own[0])
                return first[0], second[0]
        return None
