"""Decks: written and read by us and by pyNastran, the published deck, and the expanded system against the direct swap."""

from __future__ import annotations

import json
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench import Element
from bench.errors import FileFormatError, ParameterError, UnknownNameError
from bench.laws.network import NetworkWeights, published_network
from bench.nastran import (
    INCH_POUND,
    SI,
    DmigColumn,
    Mpc,
    Nolin1,
    Numbering,
    OtherCard,
    ScalarPoints,
    Sload,
    Tabled1,
    deck_text,
    network_text,
    network_weights,
    parse_deck,
    read_deck,
    read_network,
    table_error,
    tanh_points,
    write_network,
)
from bench.nastran.numbers import parse_real, real_text

# pyNastran 1.4.1 still calls np.in1d, which numpy 2.4 has removed in favour of np.isin (the same function for these calls)
setattr(np, "in1d", np.isin)  # noqa: B010  (an assignment would name what numpy no longer has)


def published_element(*joints: str) -> Element:
    published = published_network()
    return Element(published.law, joints, published.theta, name="joint")


def random_weights(rng: np.random.Generator, n_joints: int, n_hidden: int) -> NetworkWeights:
    def part(*shape: int) -> np.ndarray:
        return rng.standard_normal(shape) * 10.0 ** rng.uniform(-6.0, 6.0, shape)

    return NetworkWeights(
        part(n_hidden, 2 * n_joints), part(n_hidden), part(n_joints, n_hidden), part(n_joints)
    )


def printed_numbers() -> dict[str, np.ndarray]:
    text = resources.files("bench").joinpath("_data", "published_network.json").read_text(encoding="utf-8")
    document = json.loads(text)
    return {name: np.array(document[name]) for name in ("W1", "b1", "W2", "b2")}


def published_layout(numbers: dict[str, np.ndarray]) -> str:
    """The layout of the dissertation's appendix B.3: seven-digit numbers with E, one DMIG term a card, free-field MPC."""

    def real(value: float) -> str:
        mantissa, exponent = f"{value:.6E}".split("E")
        return f"{float(mantissa) / 10.0:.7f}E{int(exponent) + 1:+03d}"

    def term(matrix: str, column: tuple[int, int], row: tuple[int, int], value: float) -> list[str]:
        first = f"DMIG   *{matrix:>16}{column[0]:>16}{column[1]:>16}"
        return [first, f"*       {row[0]:>16}{row[1]:>16}{real(value):>16}"]

    lines = ["$ Virtual points", "SPOINT  1001    THRU    1030", "SPOINT  2001    THRU    2030"]
    lines += ["SPOINT  3001    THRU    3002", "LSEQ    601     203     501"]
    for start, biases in ((1001, numbers["b1"]), (3001, numbers["b2"])):
        lines += [f"SLOAD  *{501:>16}{start + j:>16}{real(b):>16}" for j, b in enumerate(biases)]
    lines += [f"DMIG   *{'STIF':>16}{0:>16}{1:>16}{1:>16}"]
    for j, weights in enumerate(numbers["W1"]):
        lines += term("STIF", (1001 + j, 0), (1001 + j, 1), 1.0)
        lines += term("STIF", (100, 1), (1001 + j, 0), -weights[0])
        lines += term("STIF", (100, 4), (1001 + j, 0), -weights[1])
    for j in range(30):
        lines += term("STIF", (2001 + j, 0), (2001 + j, 0), 1.0)
    for o, weights in enumerate(numbers["W2"]):
        lines += term("STIF", (3001 + o, 0), (3001 + o, 0), 1.0)
        for j, weight in enumerate(weights):
            lines += term("STIF", (2001 + j, 0), (3001 + o, 0), -weight)
    lines += ["$", f"DMIG   *{'DAMP':>16}{0:>16}{1:>16}{1:>16}"]
    for j, weights in enumerate(numbers["W1"]):
        lines += term("DAMP", (100, 1), (1001 + j, 0), -weights[2])
        lines += term("DAMP", (100, 4), (1001 + j, 0), -weights[3])
    for j in range(30):
        lines += [f"NOLIN1  {5:>8}{2001 + j:>8}{0:>8}{'1.000':>8}{1001 + j:>8}{0:>8}{112:>8}"]
    lines += ["MPC,1,3,1,1.,100,1,1.", ",,4,1,-1.", "MPC,1,3,4,1.,100,4,1.", ",,4,4,-1."]
    lines += ["NOLIN1,5,100,1,-1.,3001,0,101", "NOLIN1,5,100,4,-1.,3002,0,101"]
    lines += [
        "TABLED1,101",
        ",-1.,-1.,1.,1.,ENDT",
        "GRID    100     0       0.      0.      0.      0       2356",
    ]
    return "\n".join(lines) + "\n"


def test_published_deck_reads_into_the_published_network():
    numbers = printed_numbers()
    deck = parse_deck(published_layout(numbers), source="B.3")
    printed = read_network(deck, units=SI)  # no conversion: the numbers on the cards
    for name, expected in numbers.items():
        # seven digits on the card, the same seven in the file: the same double
        assert np.array_equal(getattr(printed.weights, name), expected)
    assert printed.components == (1, 4)
    assert printed.bodies == (3, 4)
    assert printed.tanh_error is None  # the deck keeps its tanh table in another file, which is not printed
    element = read_network(deck, units=INCH_POUND).element(["axial", "torsional"])
    np.testing.assert_allclose(element.theta, published_network().theta, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("form", ["small", "large", "free"])
@pytest.mark.parametrize("units", [SI, INCH_POUND], ids=lambda units: units.name)
def test_written_decks_read_back(tmp_path, form, units):
    element = published_element("axial", "torsional")
    path = tmp_path / "joint.bdf"
    write_network(path, element, form=form, components=(1, 4), bodies=(3, 4), units=units)
    back = read_network(path, units=units)
    # 8 characters keep at least three digits of any number, and 4 here (0.0…); 16 keep at least ten
    tolerance = 5e-4 if form == "small" else 1e-10
    for ours, theirs in zip(back.weights, network_weights(element), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=0.0)
    assert (back.components, back.bodies) == ((1, 4), (3, 4))
    assert back.tanh_error is not None
    assert back.tanh_error < 1e-6
    assert not (tmp_path / "joint.bdf").read_text().startswith("\ufeff")
    assert max(len(line) for line in path.read_text().splitlines() if not line.startswith("$")) <= 72
    assert sorted(file.name for file in tmp_path.iterdir()) == ["joint.bdf"]


@settings(max_examples=25, deadline=None)
@given(
    n_joints=st.integers(1, 6),
    n_hidden=st.integers(1, 7),
    seed=st.integers(0, 2**32 - 1),
    form=st.sampled_from(["large", "free"]),
    units=st.sampled_from([SI, INCH_POUND]),
)
def test_any_network_survives_the_round_trip(n_joints, n_hidden, seed, form, units):
    rng = np.random.default_rng(seed)
    weights = random_weights(rng, n_joints, n_hidden)
    components = tuple(int(c) for c in np.sort(rng.choice(np.arange(1, 7), n_joints, replace=False)))
    text = network_text(weights, form=form, components=components, units=units, table_points=101)
    back = read_network(parse_deck(text), units=units)
    assert back.components == components
    assert back.bodies is None
    for ours, theirs in zip(back.weights, weights, strict=True):
        np.testing.assert_allclose(
            ours, theirs, rtol=1e-9, atol=0.0
        )  # "-1.234567890-123": ten digits at least


@pytest.mark.parametrize("form", ["small", "large", "free"])
def test_pynastran_reads_the_same_values(tmp_path, form):
    from pyNastran.bdf.bdf import BDF
    from pyNastran.bdf.bdf_interface.utils import to_fields

    weights = random_weights(np.random.default_rng(3), 6, 5)
    path = tmp_path / "joint.bdf"
    write_network(path, weights, form=form, components=range(1, 7), bodies=(7, 8), table_points=101)
    ours = read_deck(path)
    model = BDF(debug=None)
    model.read_bdf(str(path), xref=False, punch=True)
    for name in ("STIF", "DAMP"):
        theirs = {
            (int(row[0]), int(row[1]), int(column[0]), int(column[1])): value
            for row, column, value in zip(
                model.dmig[name].GCi, model.dmig[name].GCj, model.dmig[name].Real, strict=True
            )
        }
        expected = {
            (point, component, card.point, card.component): value
            for card in ours.of(DmigColumn)
            if card.matrix == name
            for point, component, value in card.terms
        }
        assert theirs == expected
        assert model.dmig[name].matrix_form == 1
    loads = {card.loads[0][0]: card.loads[0][1] for card in ours.of(Sload)}
    assert {load.nodes[0]: load.mags[0] for load in model.loads[501]} == loads
    assert set(model.spoints) == {point for card in ours.of(ScalarPoints) for point in card.ids}
    for table in ours.of(Tabled1):
        assert list(zip(model.tables_d[table.id].x, model.tables_d[table.id].y, strict=True)) == list(
            table.points
        )
    relations = [
        tuple(zip(mpc.nodes, map(int, mpc.components), mpc.coefficients, strict=True))
        for mpc in model.mpcs[1]
    ]
    assert relations == [card.terms for card in ours.of(Mpc)]
    assert model.nodes[100].ps == ""
    assert (model.load_combinations[601][0].excite_id, model.load_combinations[601][0].lid) == (203, 501)
    assert (model.dload_entries[103][0].excite_id, model.dload_entries[103][0].tid) == (203, 103)
    # NOLIN1 is among the cards that pyNastran keeps as text; its field splitter still reads the columns
    cards = [[line for line in lines if line and line[0] != "$"] for lines in model.reject_lines]
    fields = [to_fields(lines, "NOLIN1") for lines in cards]
    rejected = [
        (int(f[1]), int(f[2]), int(f[3]), parse_real(f[4].strip()), int(f[5]), int(f[6]), int(f[7]))
        for f in fields
    ]
    assert rejected == [tuple(card.fields()) for card in ours.of(Nolin1)]


@settings(max_examples=300, deadline=None)
@given(value=st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_numbers_fit_their_field_and_keep_their_digits(value):
    for width, worst in ((8, 0.5), (16, 6e-9)):  # "-1.-300" has one digit, "-1.2345678-300" eight and more
        text = real_text(value, width)
        assert len(text) <= width
        assert "." in text
        if abs(value) < 1.7e308:  # a rounded mantissa of the very largest double would overflow
            assert parse_real(text) == pytest.approx(value, rel=worst, abs=0.0)


@settings(max_examples=200, deadline=None)
@given(value=st.floats(-1e12, 1e12, allow_subnormal=False))
def test_pynastran_reads_our_numbers_alike(value):
    from pyNastran.bdf.bdf_interface.assign_type import double
    from pyNastran.bdf.bdf_interface.bdf_card import BDFCard

    for width in (8, 16):
        text = real_text(value, width)
        assert double(BDFCard(["CARD", text]), 1, "value") == parse_real(text)


def test_numbers_of_everyday_size_keep_what_the_width_allows():
    assert real_text(1.2345e-4, 8) == "1.2345-4"
    assert real_text(-0.5, 8) == "-.5"
    assert real_text(0.1234567, 8) == ".1234567"
    assert real_text(-3.14159265358979, 8) == "-3.14159"
    assert real_text(-3.141592653589793, 16) == "-3.1415926535898"
    assert real_text(1.0e10, 8) == "1.+10"
    assert real_text(123456.0, 8) == "123456."
    assert [parse_real(text) for text in ("1.2345-4", "1.+3", "1.5E3", "1.5d-3", ".5", "-5.")] == [
        1.2345e-4,
        1e3,
        1.5e3,
        1.5e-3,
        0.5,
        -5.0,
    ]


MIXED = """SOL 109
INCLUDE 'not_bulk.dat'
BEGIN BULK
$ a comment
DMIG,STIF,0,1,1   $ header in free field
DMIG*   STIF                        1001               0
*                   1001               0 1.25
DMIG    STIF    1002    0               1001    0       -2.5-1          +A
+A      1002    0       1.+0
DMIG*,STIF,1003,0
*,1001,0,3.5E-2
SPOINT,1001,1002
SPOINT\t1003\tTHRU\t1005
SLOAD   501     1001    2.      1002    3.5     1003    -1.D0
CQUAD4,1,2,0,1.
ENDDATA
SPOINT,9999
"""


def test_all_forms_mix_in_one_deck():
    deck = parse_deck(MIXED)
    columns = deck.of(DmigColumn)
    assert [(c.point, c.terms) for c in columns] == [
        (1001, ((1001, 0, 1.25),)),
        (1002, ((1001, 0, -0.25), (1002, 0, 1.0))),
        (1003, ((1001, 0, 0.035),)),
    ]
    assert [card.ids for card in deck.of(ScalarPoints)] == [(1001, 1002), (1003, 1004, 1005)]
    assert deck.of(Sload) == (Sload(501, ((1001, 2.0), (1002, 3.5), (1003, -1.0))),)
    assert [card.name for card in deck.of(OtherCard)] == ["CQUAD4"]
    assert parse_deck(deck_text(deck.cards, form="large")) == deck
    assert parse_deck(deck_text(deck.cards, form="small")) == deck


def test_included_files_are_followed_and_named_in_errors(tmp_path):
    (tmp_path / "points.dat").write_text("SPOINT,1,THRU,3\n")
    (tmp_path / "main.bdf").write_text("BEGIN BULK\nINCLUDE 'points.dat'\nSPOINT,9\nENDDATA\n")
    assert [card.ids for card in read_deck(tmp_path / "main.bdf").of(ScalarPoints)] == [(1, 2, 3), (9,)]
    (tmp_path / "points.dat").write_text("$\nSPOINT,1.5\n")
    with pytest.raises(
        FileFormatError, match=r"points.dat, line 2: card SPOINT, field 2 \(point\): '1.5' found"
    ):
        read_deck(tmp_path / "main.bdf")
    (tmp_path / "points.dat").write_text("INCLUDE 'main.bdf'\n")
    with pytest.raises(FileFormatError, match="includes itself"):
        read_deck(tmp_path / "main.bdf")
    with pytest.raises(FileFormatError, match=r"cannot read .*absent.bdf"):
        read_deck(tmp_path / "absent.bdf")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "SLOAD,501,1001,3\n",
            r"line 1: card SLOAD, field 4 \(load\): '3' found, a real number with a decimal",
        ),
        ("$\nSLOAD,501,x,3.\n", r"line 2: card SLOAD, field 3 \(point\): 'x' found, an integer expected"),
        ("SLOAD,501\n", r"field 3 \(point\): blank found, an integer expected"),
        (
            "DMIG,K,1,0,,5,0,1.\n,6,0,1.2.3\n",
            r"line 2: card DMIG, field 4 \(value\): '1.2.3' found, a real number",
        ),
        (
            f"DMIG*   {'K':<16}{1:>16}{0:>16}\n*       {5:>16}{0:>16}{'abc':>16}",
            r"line 2: card DMIG, field 8 \(value\): 'abc' found",
        ),
        ("DMIG,K,0,1,3\n", r"field 5 \(TIN\): '3' found, 1 or 2 \(a real matrix\) expected"),
        ("DMIG,12,0,1,1\n", r"field 2 \(matrix\): '12' found, a name"),
        ("TABLED1,1\n,0.,0.,1.,1.\n", r"card TABLED1, field \d \(end of table\): blank found, ENDT expected"),
        ("TABLED1,1\n,0.,0.,ENDT\n", "at least two points"),
        ("TABLED1,1,LOG\n,0.,0.,1.,1.,ENDT\n", "LINEAR or blank"),
        ("SPOINT,5,THRU,3\n", r"field 4 \(last point\): '3' found, a number from 5 on expected"),
        ("TLOAD1,1,2,,7,3\n", "blank or 0"),
        (",1,2\n", "line 1: a continuation line stands here"),
        ("MPC,1,2,1,1.,,,,,+A\n+B,,3,1,1.\n", "continuation '\\+B' follows a card that asks for '\\+A'"),
        ("SPOINT,1,2,3,4,5,6,7,8,9,10\n", "10 free fields stand on one line"),
        ("SPOINT 1001 THRU 1030\n", "the columns of this line are not those of small field"),
        ("INCLUDE 'x.dat'\n", "cannot be followed"),
    ],
)
def test_malformed_cards_are_named_by_line_card_and_field(text, message):
    with pytest.raises(FileFormatError, match=message):
        parse_deck(text)


def test_decks_that_are_no_network_say_what_is_missing():
    text = network_text(published_element("a", "b"), components=(1, 4), table_points=101)

    def without(word: str) -> str:
        kept, dropping = [], False
        for line in text.splitlines():
            dropping = word in line if line[:1] not in "*+ " else dropping
            kept += [] if dropping else [line]
        return "\n".join(kept)

    with pytest.raises(FileFormatError, match="no NOLIN1 of set 5"):
        read_network(parse_deck(without("NOLIN1")))
    with pytest.raises(FileFormatError, match=r"no header of a DMIG 'DAMP'; it holds \['STIF'\]"):
        read_network(parse_deck(without("DAMP")))
    with pytest.raises(FileFormatError, match="one virtual grid"):
        read_network(parse_deck(without("SPOINT")))
    other = network_text(published_element("a", "b"), components=(1, 4), numbering=Numbering(nonlinear=9))
    with pytest.raises(FileFormatError, match="no NOLIN1 of set 5"):
        read_network(parse_deck(other))
    straight = text.replace("112", "101").replace(f"TABLED1*{101:>16}", "$", 1)
    with pytest.raises(FileFormatError, match="deviates from tanh"):
        read_network(parse_deck(straight))


def test_bad_requests_are_refused():
    element = published_element("axial", "torsional")
    with pytest.raises(ParameterError, match="as many different ones from 1 to 6"):
        network_text(element, components=(1, 1))
    with pytest.raises(ParameterError, match="overlap"):
        network_text(element, components=(1, 4), numbering=Numbering(hidden=1010))
    with pytest.raises(ParameterError, match="only a network can be written"):
        network_text(Element.of("linear", "axial"), components=(1,))
    with pytest.raises(UnknownNameError, match="form of a deck"):
        network_text(element, form="wide", components=(1, 4))  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="odd number"):
        tanh_points(10)
    weights = network_weights(element)
    with pytest.raises(ParameterError, match="finite"):
        network_text(weights._replace(b1=weights.b1 * np.nan), components=(1, 4))


def test_tanh_table_is_as_close_as_its_points_allow():
    errors = [table_error(tanh_points(n)) for n in (201, 401, 801)]
    # chords: a quarter of the error for twice the points
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)
    # equal steps of arc over |x| < 10 would need 0.77 (20/401)^2 / 8 = 2.4e-4
    assert errors[1] < 2e-5
    far = dict(tanh_points(201))
    assert far[20.0] == 1.0
    assert far[-21.0] == -1.0
