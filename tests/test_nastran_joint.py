"""The original model of appendix B.1: read from cards as printed, written, and the same force from the cards and from the law."""

from __future__ import annotations

import numpy as np
import pytest

from bench.errors import FileFormatError, ParameterError
from bench.laws.along import force_along
from bench.nastran import INCH_POUND, deck_text, joint_model_cards, parse_deck, read_joint_model
from bench.rig import Element

PRINTED = """\
BEGIN BULK
MPC,1,3,1,1.,100,1,1.
,,4,1,-1.
MPC,1,3,4,1.,100,4,1.
,,4,4,-1.
NOLIN1,5,100,1,-1800.,100,1,102
NOLIN1,5,100,4,-1800.,100,4,102
NOLIN2,5,100,1,-500.,100,11,200,4
NOLIN2,5,100,4,-500.,100,14,200,1
NOLIN1,5,200,1,1.,100,1,104
NOLIN1,5,200,4,1.,100,4,105
TABLED1,102
,-1.2,-1.,-.2,0.,.2,0.,1.2,1.
,ENDT
TABLED1,104
,-1.2,1.,-.2,0.,.2,0.,1.2,1.
,ENDT
TABLED1,105
,-1.2,1.,-.2,0.,.2,0.,1.2,1.
,ENDT
SPC     1       1       123456  0.
SPC     1       6       123456  0.
PBAR    4       1       1.      1.      1.      1.
MAT1    1       2.9E+7          0.32
GRID    2       0       0.      0.      0.      0       2356
GRID    3       0       .9      0.      0.      0       2356
GRID    4       0       1.1     0.      0.      0       2356
GRID    5       0       2.      0.      0.      0       2356
GRID    100     0       0.      0.      0.      0       2356
GRID    200     0       0.      0.      0.      0       2356
CELAS2  1       1000.   1       1       2       1       0.
CELAS2  2       1000.   5       1       6       1       0.
CELAS2  3       200.    3       1       4       1       0.
CELAS2  4       1.      200     1
CELAS2  11      1000.   1       4       2       4       0.
CELAS2  12      1000.   5       4       6       4       0.
CELAS2  13      200.    3       4       4       4       0.
CBAR    6       4       2       3       0.      1.      0.
CBAR    7       4       4       5       0.      1.      0.
CBAR    8       4       3       4       0.      1.      0.
        14      14
CDAMP2  1       10.0    1       1       2       1
CDAMP2  2       10.0    5       1       6       1
CDAMP2  3       6.32    3       1       4       1
CDAMP2  11      10.0    1       4       2       4
CDAMP2  12      10.0    5       4       6       4
CDAMP2  13      6.32    3       4       4       4
CONM2   1       2       0       1.      0.      0.      0.              +EL A
+EL A   1.      0.      0.      0.      0.      0.
CONM2   2       5       0       1.      0.      0.      0.              +EL B
+EL B   1.      0.      0.      0.      0.      0.
CONM2   3       3       0       1.      0.      0.      0.              +EL C
+EL C   1.      0.      0.      0.      0.      0.
CONM2   4       4       0       1.      0.      0.      0.              +EL D
+EL D   1.      0.      0.      0.      0.      0.
ENDDATA
"""
"""The joint, mounts, bars and masses of the deck; its columns are lost in the text and were set anew."""


def test_the_printed_deck_is_the_catalogues_joint_and_what_it_lacks_is_told():
    model = read_joint_model(parse_deck(PRINTED), units=INCH_POUND)
    assert model.bodies == (3, 4)
    assert model.axes[0] == model.axes[1] == (200.0, 6.32, 1800.0, 0.2, 500.0)
    assert model.masses == dict.fromkeys((2, 3, 4, 5), (1.0, 1.0))
    assert model.mounts == dict.fromkeys((2, 5), (1000.0, 10.0, 1000.0, 10.0))
    # E A / L and G J / L of steel bars of length 0.9; the bar across the joint is released in both
    assert set(model.bars) == {(2, 3), (4, 5)}
    assert model.bars[2, 3] == pytest.approx((2.9e7 / 0.9, 2.9e7 / 2.64 / 0.9))
    assert len(model.notes) == 1
    assert "component 4 of grid 200" in model.notes[0]
    ours = model.element(("axial_23", "torsional_23"))
    true = Element.of("axial_torsional_joint", "axial_23", "torsional_23", name="joint")
    np.testing.assert_allclose(ours.theta, true.theta, rtol=1e-12)


@pytest.mark.parametrize("form", ["small", "large", "free"])
def test_a_joint_written_and_read_back_is_the_same_and_lacks_nothing(form):
    joint = Element.of(
        "axial_torsional_joint",
        "a",
        "b",
        k_axial=31e3,
        c_coupling_axial=5e3,
        clearance_torsional=0.11,
        k_gap_torsional=77.0,
    )
    body = "CONM2,1,3,0,1.,,,,\n,1.\nCONM2,2,4,0,1.,,,,\n,1.\n"
    deck = parse_deck(deck_text(joint_model_cards(joint, units=INCH_POUND), form=form) + body)
    model = read_joint_model(deck, units=INCH_POUND)
    assert model.notes == ()
    # small fields hold at least three digits after the first
    tolerance = 5e-4 if form == "small" else 1e-8
    np.testing.assert_allclose(model.element(("a", "b")).theta, joint.theta, rtol=tolerance)


def test_the_cards_give_the_force_of_the_law():
    deck = parse_deck(PRINTED)
    rng = np.random.default_rng(1)
    q, v = rng.uniform(-0.6, 0.6, (200, 2)), rng.uniform(-8.0, 8.0, (200, 2))
    axis = {1: 0, 4: 1}

    def table(number, x):
        points = np.array(
            next(card.points for card in deck.cards if card.name == "TABLED1" and card.id == number)
        )
        return np.interp(x, *points.T)

    auxiliary = {
        card.loaded_component: card.scale * table(card.table, q[:, axis[card.read_component]])
        for card in deck.cards
        if card.name == "NOLIN1" and card.loaded == 200
    }
    force = 200.0 * q + 6.32 * v
    for card in deck.cards:
        if card.name == "NOLIN1" and card.loaded == 100:
            force[:, axis[card.loaded_component]] -= card.scale * table(
                card.table, q[:, axis[card.read_component]]
            )
        if card.name == "NOLIN2":
            speed = v[:, axis[card.first[1] - 10]]
            force[:, axis[card.loaded_component]] -= card.scale * speed * auxiliary[card.second[1]]
    joint = read_joint_model(deck, units=INCH_POUND).element(("a", "b"))
    inch, pound = INCH_POUND.metres, INCH_POUND.newtons
    ours = force_along(joint.law, joint.theta, np.arange(200.0), q * [inch, 1.0], v * [inch, 1.0]) / [
        pound,
        pound * inch,
    ]
    np.testing.assert_allclose(ours, force, rtol=1e-9, atol=1e-9)


def test_decks_that_hold_no_such_joint_are_refused():
    with pytest.raises(FileFormatError, match="no MPC"):
        read_joint_model(parse_deck("GRID,1\n"))
    with pytest.raises(FileFormatError, match="TABLED1 102"):
        read_joint_model(parse_deck(PRINTED.replace("TABLED1,102", "TABLED1,902")))
    with pytest.raises(FileFormatError, match="no product"):
        read_joint_model(parse_deck(PRINTED.replace("100,11,200,4", "100,1,200,4")))
    with pytest.raises(FileFormatError, match="refers to"):
        read_joint_model(parse_deck(PRINTED.replace("PBAR    4", "PBAR    5")))
    with pytest.raises(ParameterError, match="axial_torsional_joint"):
        joint_model_cards(Element.of("linear", "a", stiffness=1.0, damping=0.0))
