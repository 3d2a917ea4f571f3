"""Rows on the deck of appendix B.1 and on the networks of appendix B.2 and eq 5.55, for item D4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.nastran import INCH_POUND, deck_text, joint_model_cards, parse_deck, read_joint_model
from bench.nastran.raw_card import Card
from bench.nastran.structure_cards import Conm2, ScalarElement
from bench.reproduction.chain_joint import AXES
from bench.reproduction.verdict import Row, fact_row, told_row, value_row
from bench.rig import Element


@dataclass(frozen=True)
class OriginalDeckSetup:
    """Numbers of `bench.reproduction.original_deck`."""

    spring: tuple[int, int] = (200, 4)
    """Grid and component that the printed deck leaves without its spring."""


SETUP = OriginalDeckSetup()


def _cards() -> list[Card | str]:
    joint = Element.of("axial_torsional_joint", *AXES, name="joint")
    bodies: list[Card | str] = [Conm2(number, grid, 1.0, 1.0) for number, grid in ((3, 3), (4, 4))]
    return [*joint_model_cards(joint, units=INCH_POUND), *bodies]


def rows() -> list[Row]:
    """The joint written as such a deck and read back, whole and as printed, and the networks that cannot be used."""
    true = Element.of("axial_torsional_joint", *AXES, name="joint")
    whole = read_joint_model(parse_deck(deck_text(_cards())), units=INCH_POUND)
    printed_cards = [
        card for card in _cards() if not (isinstance(card, ScalarElement) and card.first == SETUP.spring)
    ]
    printed = read_joint_model(parse_deck(deck_text(printed_cards)), units=INCH_POUND)
    worst = float(np.max(np.abs(whole.element(AXES).theta / true.theta - 1.0)))
    return [
        value_row(
            "original model (NOLIN1, NOLIN2, CELAS2, CDAMP2, MPC) written and read back: largest difference of a parameter",
            "1",
            None,
            worst,
            high=1e-8,
            reason="digits that large fields hold",
        ),
        fact_row(
            "the deck as printed determines its motion",
            "; ".join(printed.notes) if printed.notes else "it does",
            not printed.notes,
            printed="input file of the original model",
            source="appendix B.1, pp. 154 to 157, cards",
            tolerance="every loaded component has a stiffness, a damping or a mass",
            reason="an equation 0 = load has no solution",
            why="CELAS2 4 gives component 1 of grid 200 a spring of 1 to the ground; that of component 4 is missing, by a slip: with it "
            "the deck is the joint of the published figures and network",
        ),
        told_row(
            "network of appendix B.2",
            "",
            "not used",
            "its 30 rows have lost their order in the text layer (two columns of rows, three lists of one order): rows of W1, b1 and "
            "columns of W2 cannot be put together again with certainty. Appendix B.3 holds another training of the same network, whole",
            printed="30 units, W1, b1, W2, b2",
            source="appendix B.2, pp. 157, 158, numbers",
        ),
        told_row(
            "network of eq 5.55",
            "",
            "not used",
            "18 of 30 rows are left out (dots); the rest is in the ±1 scaling of the training, whose limits are not printed",
            printed="12 of 30 rows",
            source="eq 5.55, p. 123, numbers",
        ),
    ]
