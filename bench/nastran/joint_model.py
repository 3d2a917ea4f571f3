"""The original model of appendix B.1: a joint with dead-spaces and coupling as bulk data, read into an element and written from one.

The joint lies between two grids in a component of translation and one of rotation. Linear springs and dampers are CELAS2 and CDAMP2;
the relative motion is a grid of its own, tied by MPC; on it act NOLIN1 with the dead-space as a table, and NOLIN2, velocity times the
displacement of a second auxiliary grid. That grid carries ``|ds|`` of either axis: NOLIN1 puts it there as a load, and a spring of one
to the ground makes a displacement of the load.

The printed deck gives this spring on component 1 of grid 200 only (CELAS2 4). Component 4 bears a load, and has neither stiffness nor
damping nor mass: its equation is ``0 = load``, which no integration solves. `read_joint_model` tells it and reads the spring of one
that the deck's author must have had; `joint_model_cards` writes it.

References:
    Tasbihgoo 2006, appendix B.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bench.errors import FileFormatError, ParameterError
from bench.laws import find_law
from bench.nastran.bulk import Deck
from bench.nastran.cards import Grid, Mpc, Nolin1, Tabled1
from bench.nastran.network_deck import SI, Units, unit_scales
from bench.nastran.raw_card import Card
from bench.nastran.structure_cards import Cbar, Conm2, Mat1, Nolin2, Pbar, ScalarElement, Spc
from bench.rig import Element


@dataclass(frozen=True)
class JointModelSettings:
    """Numbers of `bench.nastran.joint_model`."""

    axes: tuple[int, int] = (1, 4)
    """Components of the joint: translation along and rotation about x."""


SETTINGS = JointModelSettings()


class JointAxis(NamedTuple):
    """The joint in one component, in the deck's units."""

    stiffness: float
    damping: float
    gap_stiffness: float
    clearance: float
    coupling: float
    """Damping per unit of the other axis's motion beyond its clearance."""


@dataclass(frozen=True)
class JointModel:
    """What a deck says of a joint and of the structure about it.

    Attributes:
        axes: The joint along and about x.
        bodies: Grids that it connects, first and second.
        masses: Mass and inertia by grid.
        mounts: Stiffness and damping to a held grid, axial then torsional, by grid.
        bars: Axial and torsional stiffness of bars that carry both, by their grids.
        notes: What the deck leaves out or says twice, in sentences.
        units: Units of the deck.
    """

    axes: tuple[JointAxis, JointAxis]
    bodies: tuple[int, int]
    masses: dict[int, tuple[float, float]]
    mounts: dict[int, tuple[float, float, float, float]]
    bars: dict[tuple[int, int], tuple[float, float]]
    notes: tuple[str, ...]
    units: Units = field(default=SI)

    def element(self, joints: tuple[str, str], *, name: str = "joint") -> Element:
        """The joint as an element on an axial and a torsional coordinate, in SI units.

        Args:
            joints: Names of the coordinates.
            name: Name of the element.
        """
        motion, force = unit_scales(SETTINGS.axes, self.units)
        values: dict[str, float] = {}
        for i, (axis, label) in enumerate(zip(self.axes, ("axial", "torsional"), strict=True)):
            linear = force[i] / motion[i]
            values |= {
                f"k_{label}": axis.stiffness * linear,
                f"c_{label}": axis.damping * linear,
                f"k_gap_{label}": axis.gap_stiffness * linear,
                f"clearance_{label}": axis.clearance * motion[i],
                f"c_coupling_{label}": axis.coupling * linear / motion[1 - i],
            }
        law = find_law("axial_torsional_joint")
        return Element(law, joints, law.theta(**values), name=name)


def read_joint_model(deck: Deck, *, units: Units = SI) -> JointModel:
    """Read the joint of a deck of the form of appendix B.1.

    Args:
        deck: The deck.
        units: Its units.

    Raises:
        FileFormatError: There is no such joint in it, or a card refers to what is not there.
    """
    relative, bodies = _relative(deck)
    notes: list[str] = []
    auxiliary = _auxiliary(deck, relative, notes)
    axes = [_axis(deck, relative, bodies, component, auxiliary) for component in SETTINGS.axes]
    held = {card.grid for card in deck.of(Spc)}
    mounts = {}
    for grid in dict.fromkeys(card.grid for card in deck.of(Conm2)):
        found = [
            _between(deck, kind, grid, component, held)
            for component in SETTINGS.axes
            for kind in ("CELAS2", "CDAMP2")
        ]
        if any(found):
            mounts[grid] = (found[0], found[1], found[2], found[3])
    masses = {card.grid: (card.mass, card.inertia) for card in deck.of(Conm2)}
    return JointModel((axes[0], axes[1]), bodies, masses, mounts, _bars(deck), tuple(notes), units)


def _relative(deck: Deck) -> tuple[int, tuple[int, int]]:
    """The grid of the relative motion, and the bodies: ``u_relative + u_first - u_second = 0``, in any order and sign."""
    found: dict[int, set[tuple[int, int]]] = {}
    for card in deck.of(Mpc):
        if len(card.terms) != 3 or len({component for _, component, _ in card.terms}) != 1:
            continue
        signs = {point: coefficient for point, _, coefficient in card.terms}
        masses = {mass.grid for mass in deck.of(Conm2)}
        free = [point for point in signs if point not in masses]
        if len(free) != 1:
            continue
        own = signs.pop(free[0])
        second = [point for point, sign in signs.items() if sign * own < 0.0]
        first = [point for point, sign in signs.items() if sign * own > 0.0]
        if len(first) == len(second) == 1:
            found.setdefault(free[0], set()).add((first[0], second[0]))
    for relative, pairs in found.items():
        if len(pairs) == 1:
            return relative, next(iter(pairs))
    raise FileFormatError(
        "the deck has no MPC that ties a grid to the relative motion of two masses; a joint of appendix B.1 is expected"
    )


def _table(deck: Deck, number: int) -> Tabled1:
    for card in deck.of(Tabled1):
        if card.id == number:
            return card
    raise FileFormatError(f"NOLIN1 names TABLED1 {number}, which the deck lacks")


def _dead_space(table: Tabled1, *, signed: bool) -> tuple[float, float]:
    """Clearance and slope of a table that is a dead-space, or its absolute value; (0, 0) where it is neither."""
    x, y = np.array(table.points).T
    flat = [(a, b) for a, b in pairwise(range(len(x))) if y[a] == y[b] == 0.0]
    if len(flat) != 1 or len(x) != 4 or abs(x[flat[0][0]] + x[flat[0][1]]) > 1e-9 * np.abs(x).max():
        return 0.0, 0.0
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[3] - y[2]) / (x[3] - x[2])
    if abs(left - (right if signed else -right)) > 1e-9 * abs(right):
        return 0.0, 0.0
    return float(x[2]), float(right)


def _auxiliary(
    deck: Deck, relative: int, notes: list[str]
) -> dict[tuple[int, int], tuple[int, float, float]]:
    """Auxiliary components that carry ``|ds|``: by point and component, the axis read, its clearance, and displacement over it."""
    found = {}
    for load in deck.of(Nolin1):
        if load.loaded == relative or load.read_from != relative:
            continue
        clearance, slope = _dead_space(_table(deck, load.table), signed=False)
        place = (load.loaded, load.loaded_component)
        springs = [
            card.value
            for card in deck.of(ScalarElement)
            if card.kind == "CELAS2" and card.first == place and card.second == (0, 0)
        ]
        if not springs:
            notes.append(
                f"component {place[1]} of grid {place[0]} bears a nonlinear load and has neither stiffness, damping nor mass, so that "
                "its displacement is not determined: taken as the load itself, as a spring of 1 to the ground would have it"
            )
        found[place] = (load.read_component, clearance, load.scale * slope / (springs[0] if springs else 1.0))
    return found


def _axis(
    deck: Deck,
    relative: int,
    bodies: tuple[int, int],
    component: int,
    auxiliary: dict[tuple[int, int], tuple[int, float, float]],
) -> JointAxis:
    gaps = [
        (load, *_dead_space(_table(deck, load.table), signed=True))
        for load in deck.of(Nolin1)
        if (load.loaded, load.loaded_component)
        == (relative, component)
        == (load.read_from, load.read_component)
    ]
    clearance = gaps[0][1] if gaps else 0.0
    gap_stiffness = -gaps[0][0].scale * gaps[0][2] if gaps else 0.0
    coupling = 0.0
    for product in deck.of(Nolin2):
        if (product.loaded, product.loaded_component) != (relative, component):
            continue
        factors = {product.first, product.second}
        velocity, other = (relative, component + 10), factors - {(relative, component + 10)}
        if velocity not in factors or not other <= auxiliary.keys():
            raise FileFormatError(
                f"NOLIN2 on component {component} of grid {relative} is no product of its velocity and a dead-space of the other axis"
            )
        read, _, gain = auxiliary[next(iter(other))]
        if read == component:
            raise FileFormatError(
                f"NOLIN2 couples component {component} of grid {relative} with itself; the other axis is expected"
            )
        coupling = -product.scale * gain
    return JointAxis(
        _between(deck, "CELAS2", bodies[0], component, {bodies[1]}),
        _between(deck, "CDAMP2", bodies[0], component, {bodies[1]}),
        gap_stiffness,
        clearance,
        coupling,
    )


def _between(deck: Deck, kind: str, grid: int, component: int, others: set[int]) -> float:
    """Sum of springs or dampers between a component of a grid and the same of others."""
    total = 0.0
    for card in deck.of(ScalarElement):
        ends = {card.first, card.second}
        if card.kind == kind and (grid, component) in ends:
            other = next(iter(ends - {(grid, component)}), (0, 0))
            if other[0] in others and other[1] == component:
                total += card.value
    return total


def _bars(deck: Deck) -> dict[tuple[int, int], tuple[float, float]]:
    """Stiffness of bars: ``E A / L`` and ``G J / L``, zero where pins release them."""
    grids = {card.id: card for card in deck.of(Grid)}
    sections = {card.id: card for card in deck.of(Pbar)}
    materials = {card.id: card for card in deck.of(Mat1)}
    found = {}
    for bar in deck.of(Cbar):
        try:
            section = sections[bar.section]
            material = materials[section.material]
            a, b = (np.array(grids[end].position) for end in bar.ends)
        except KeyError as error:
            raise FileFormatError(f"CBAR {bar.id} refers to {error}, which the deck lacks") from None
        length = float(np.linalg.norm(b - a))
        axial, torque = bar.carries
        if length == 0.0:
            raise FileFormatError(f"CBAR {bar.id} has no length")
        if axial or torque:
            found[bar.ends] = (
                axial * material.modulus * section.area / length,
                torque * material.shear_modulus * section.torsion / length,
            )
    return found


def joint_model_cards(
    joint: Element,
    *,
    bodies: tuple[int, int] = (3, 4),
    units: Units = SI,
    relative: int = 100,
    auxiliary: int = 200,
) -> list[Card | str]:
    """The joint as cards of the form of appendix B.1, with the spring that the printed deck lacks.

    Args:
        joint: An element of `axial_torsional_joint`.
        bodies: Grids that it connects, first and second.
        units: Units of the deck.
        relative: Grid of the relative motion.
        auxiliary: Grid of the dead-spaces' absolute values.

    Raises:
        ParameterError: Another law.
    """
    law = find_law("axial_torsional_joint")
    if joint.law.name != law.name:
        raise ParameterError(
            f"an element of the law '{joint.law.name}' came; one of '{law.name}' is expected"
        )
    motion, force = unit_scales(SETTINGS.axes, units)
    theta = dict(zip(law.parameter_names, (float(value) for value in joint.theta), strict=True))
    cards: list[Card | str] = [
        "Joint with dead-spaces and coupling (form of Tasbihgoo 2006, appendix B.1), written by jointbench.",
        "Case control: MPC = 1, NONLINEAR = 5. Springs 4 and 5 turn the loads on the auxiliary grid into displacements.",
    ]
    cards += [Grid(number, constrained="2356") for number in (relative, auxiliary)]
    for i, (component, label) in enumerate(zip(SETTINGS.axes, ("axial", "torsional"), strict=True)):
        linear = force[i] / motion[i]
        other = SETTINGS.axes[1 - i]
        clearance = theta[f"clearance_{label}"] / motion[i]
        far = clearance + 1.0
        table, absolute = 102 + 10 * i, 104 + i
        k, c, gap = (theta[f"{name}_{label}"] / linear for name in ("k", "c", "k_gap"))
        coupling = theta[f"c_coupling_{label}"] / linear * motion[1 - i]
        cards += [
            Mpc(1, ((bodies[0], component, 1.0), (relative, component, 1.0), (bodies[1], component, -1.0))),
            ScalarElement(3 + 10 * i, k, (bodies[0], component), (bodies[1], component)),
            ScalarElement(3 + 10 * i, c, (bodies[0], component), (bodies[1], component), "CDAMP2"),
            ScalarElement(4 + i, 1.0, (auxiliary, component)),
            Tabled1(table, ((-far, -1.0), (-clearance, 0.0), (clearance, 0.0), (far, 1.0))),
            Tabled1(absolute, ((-far, 1.0), (-clearance, 0.0), (clearance, 0.0), (far, 1.0))),
            Nolin1(5, relative, component, -gap, relative, component, table),
            Nolin1(5, auxiliary, component, 1.0, relative, component, absolute),
            Nolin2(5, relative, component, -coupling, (relative, component + 10), (auxiliary, other)),
        ]
    return cards
