"""The reproduction: its registry, its bookkeeping, the small solvers its items bring, and the quick items whole."""

from __future__ import annotations

import json
import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from bench.errors import UnknownNameError
from bench.reproduction import ENTRIES, Item, ItemEntry, Result, find_entries, reproduce, running
from bench.reproduction.printed_figures import PANELS
from bench.reproduction.verdict import OWN, RowVerdict, axis_row, fact_row, one_of_ours, value_row
from bench.reproduction.writing import items_summary, to_gallery, to_markdown

DOCS = Path(__file__).resolve().parent.parent / "docs"


def names(*given):
    return [entry.identifier for entry in find_entries(given)]


def silent(label, share):
    assert 0.0 <= share <= 1.0


def test_items_are_found_by_name_chapter_and_alias():
    assert names() == list(ENTRIES)
    assert names("b") == ["B1", "B2", "B3"]
    assert names("d4", "A1", "a1") == ["A1", "D4"]
    assert names("C1", "D2") == ["C2", "D3"]
    assert names("c4", "D5") == ["C4", "D5"]
    with pytest.raises(UnknownNameError, match="E7"):
        find_entries(["A1", "E7"])


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))
def test_every_item_can_be_run(entry):
    assert callable(import_module(f"bench.reproduction.{entry.module}").run)
    assert entry.weight > 0.0


def range_of(values, seeds=(), **options):
    return axis_row("x", "in", 1.0, 0.5, values, source="Fig 1", seeds=seeds, **options)


def test_a_range_holds_only_if_both_of_its_ends_lie_where_the_axis_says():
    assert range_of([-0.9, 0.0, 0.6]).verdict is RowVerdict.HOLDS
    assert range_of([-0.9, 0.0, 0.4]).verdict is RowVerdict.FAILS
    assert range_of([-1.1, 0.0, 0.9]).verdict is RowVerdict.FAILS
    assert range_of([-0.3, 0.0, 0.9], below=(0.4, 0.2)).verdict is RowVerdict.HOLDS


def test_the_verdict_is_that_of_the_seeds_and_not_of_the_record_shown():
    wide, fit = [-1.2, 1.2], [-0.8, 0.8]
    assert range_of(fit, seeds=[wide, wide, fit]).verdict is RowVerdict.FAILS
    assert range_of(wide, seeds=[fit, fit, wide]).verdict is RowVerdict.HOLDS
    row = value_row("n", "1", 2.0, 5.0, low=1.0, high=3.0, seeds=[2.0, 2.5, 9.0])
    assert row.verdict is RowVerdict.HOLDS
    assert row.spread == "2.5 (2 … 9)"
    assert value_row("n", "1", 2.0, 2.0, high=3.0, seeds=[4.0, 5.0, 2.0]).verdict is RowVerdict.FAILS


def test_a_value_holds_between_its_limits_and_cannot_be_judged_without():
    assert value_row("n", "1", 2.0, 2.1, low=1.9, high=2.2).holds is True
    assert value_row("n", "1", 2.0, 2.3, high=2.2).holds is False
    assert value_row("n", "1", 2.0, 2.3, high=2.2, shape=(0.0, 3.0)).verdict is RowVerdict.SHAPE
    assert value_row("n", "1", None, math.nan, high=2.2).holds is False
    assert value_row("n", "1", 2.0, 2.3).verdict is RowVerdict.NOT_COMPARABLE
    assert value_row("n", "1", 2.0, 2.3).holds is None
    assert value_row("n", "1", 2.0, 2.3).deviation == pytest.approx(15.0)


def test_a_printed_value_holds_where_it_could_be_one_of_ours():
    def row(printed, seeds):
        return one_of_ours("e", "%", printed, seeds[0], seeds, source="p. 1", shape=(0.0, 5.0)).verdict

    assert row(4.0, [3.0, 3.5, 4.5]) is RowVerdict.HOLDS
    assert row(2.0, [3.0, 3.5, 4.5]) is RowVerdict.SHAPE
    assert row(2.0, [6.0, 7.0, 8.0]) is RowVerdict.FAILS
    assert row(9.0, [3.0, 3.5, 4.5]) is RowVerdict.FAILS


def test_what_was_put_in_is_told_and_not_counted_as_evidence():
    rows = (
        fact_row("a", "1", True, printed="1", source="p. 1"),
        fact_row("b", "1", True, printed="1", source="p. 1", chosen="it"),
        fact_row("c", "2", False, printed="1", source="p. 1"),
        fact_row("d", "1", True),
    )
    told = items_summary([Result("A1", "t", "x", "nothing", rows, (), 1.0, "v")])
    assert "Of 3 things that the text prints, 2 hold, 0 hold in shape only, 1 does not hold" in told
    assert "1 of those that hold were put in" in told
    assert "Of 1 checks of our own" in told
    assert rows[3].source == OWN


@pytest.fixture(scope="module")
def published():
    """The results that the documentation's pages are made of."""
    values = json.loads((DOCS / "reproduction.json").read_text(encoding="utf-8"))
    return [Result.from_dict(item) for item in values["items"]]


def test_gallery_and_table_are_made_of_the_same_results(published):
    assert [result.identifier for result in published] == list(ENTRIES)
    assert (DOCS / "reproduction.md").read_text(encoding="utf-8") == to_markdown(published)
    assert (DOCS / "gallery.md").read_text(encoding="utf-8") == to_gallery(published)
    shown = {picture.file for result in published for picture in result.pictures}
    assert shown == {path.name for path in (DOCS / "gallery").glob("*.png")}


def test_no_figure_of_the_text_is_left_out(published):
    shown = [panel for result in published for picture in result.pictures for panel in picture.shows]
    assert sorted(set(shown)) == sorted(PANELS)
    assert len(shown) == len(set(shown))


def test_every_row_says_where_it_is_printed_and_why_it_is_judged_so(published):
    for result in published:
        assert result.searched
        for row in result.rows:
            name = f"{result.identifier}: {row.quantity}"
            assert row.source, name
            assert row.reason, name
            assert (row.source == OWN) == row.own, name
            assert row.holds is None or row.tolerance, name
            if row.verdict in {RowVerdict.FAILS, RowVerdict.SHAPE} and not row.own:
                assert row.why, name


class Counting:
    """Stands in for an item's module."""

    def __init__(self):
        self.runs = []
        self.fail = ""

    def make(self, entry, progress):
        from bench.figures.look import axes_grid
        from bench.reproduction import Picture

        if entry.identifier == self.fail:
            raise KeyboardInterrupt
        self.runs.append(entry.identifier)
        progress("half", 0.5)
        figure, grid = axes_grid(2.0, 1.0)
        grid[0, 0].plot([0.0, 1.0])
        rows = (
            value_row("speed | size", "m/s", 2.0, 2.1, high=2.2, source="p. 1", reason="so"),
            value_row("<b>", "", None, 1.0, reason="reported"),
        )
        pictures = (Picture("line", "A line.", figure, ("2.6 a",)),)
        return Item("One paragraph.\n\nAnother.", rows, pictures, "nothing")


@pytest.fixture
def counting(monkeypatch):
    item = Counting()

    def run(entry, progress):
        return item.make(entry, progress)

    monkeypatch.setattr(ItemEntry, "run", run)
    return item


def test_items_are_written_and_kept(tmp_path, counting, monkeypatch):
    out = tmp_path / "deep" / "out"
    first = reproduce(["A1", "A2"], out, progress=silent)
    assert counting.runs == ["A1", "A2"]
    assert all(path.is_file() for path in first.files)
    assert first.holds
    table = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert [item["identifier"] for item in table["items"]] == ["A1", "A2"]
    row = table["items"][0]["rows"][0]
    told = {name: row[name] for name in ("printed", "source", "ours", "tolerance", "reason", "verdict")}
    assert list(told.values()) == ["2", "p. 1", "2.1", "at most 2.2", "so", "holds"]
    assert Result.from_dict(table["items"][1]) == first.results[1]
    assert "speed \\| size" in (out / "table.md").read_text(encoding="utf-8")
    page = (out / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 2
    assert "&lt;b&gt;" in page

    assert reproduce(["A1", "A2"], out).results == first.results
    assert counting.runs == ["A1", "A2"]
    reproduce(["A2"], out, fresh=True)
    assert counting.runs == ["A1", "A2", "A2"]
    (out / "A1_line.png").unlink()
    reproduce(["A1"], out)
    assert counting.runs[3:] == ["A1"]
    (out / "A1.json").write_text("{", encoding="utf-8")
    reproduce(["A1"], out)
    assert counting.runs[4:] == ["A1"]
    monkeypatch.setattr(running, "fingerprint", lambda: "other code")
    reproduce(["A1"], out)
    assert counting.runs[5:] == ["A1"]


def test_a_stopped_run_is_taken_up_where_it_stopped(tmp_path, counting):
    counting.fail = "A3"
    with pytest.raises(KeyboardInterrupt):
        reproduce(["A1", "A2", "A3"], tmp_path)
    assert not (tmp_path / "table.json").exists()
    counting.fail = ""
    assert len(reproduce(["A1", "A2", "A3"], tmp_path).results) == 3
    assert counting.runs == ["A1", "A2", "A3"]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_frequency_and_damping_of_an_exact_decay():
    from bench.reproduction.free_vibration import frequency_and_damping

    time = np.arange(0.0, 3.0, 1e-3)
    omega, ratio = 2.0 * math.pi * 2.7, 0.08
    decay = np.exp(-ratio * omega * time) * np.sin(omega * math.sqrt(1.0 - ratio**2) * time)
    found = frequency_and_damping(decay, time)
    # 1 ms samples: a peak is missed by up to (omega h / 2)^2 / 2 = 4e-5 of itself, over ln(decrement) of 0.5
    assert found == pytest.approx((2.7, ratio), rel=1e-3)


def test_the_chain_comes_to_rest_where_statics_say():
    from bench.reproduction.linear_chain import (
        LINEAR_CHAIN_SETUP,
        exact,
        matrix,
    )

    stiffness = matrix(LINEAR_CHAIN_SETUP.springs)
    assert np.array_equal(stiffness, stiffness.T)
    assert np.all(np.linalg.eigvalsh(stiffness) > 0.0)
    assert np.count_nonzero(matrix(LINEAR_CHAIN_SETUP.springs, as_printed=True) - stiffness) == 1
    load = np.array([300.0, -200.0])
    end = exact(np.tile(load, (2500, 1)), 0.01)[-1]
    # slowest mode 3.6 Hz, damped by about 5 1/s: 25 s leave e^-60 of the start; 1e-9 is left to rounding
    np.testing.assert_allclose(end, np.linalg.solve(stiffness, [*load, 0, 0, 0, 0, 0, 0]), rtol=1e-9)


def test_integration_without_hysteresis_is_an_oscillator():
    from bench.reproduction.bouc_wen_rig import SETUP, integrate_alone

    n = 4000
    rows = integrate_alone(np.full(n, 2.0), [np.array([5.0, 0.0, 0.0, 0.0, 0.0])] * n)
    time = np.arange(n) / SETUP.rate
    # RK4 at omega h = 2e-3: (omega h)^4 / 120 of a radian a radian, far below 1e-10
    np.testing.assert_allclose(rows[:, 0], 0.4 * (1.0 - np.cos(math.sqrt(5.0) * time)), atol=1e-10)
    np.testing.assert_allclose(rows[:, 2], 2.0 * np.cos(math.sqrt(5.0) * time), atol=1e-9)


def test_the_encoders_lag_as_the_load_cells_do():
    from bench.reproduction import laboratory
    from bench.rig import simulate

    true = simulate(laboratory.rig(), laboratory.drive((True, True)), rng=np.random.default_rng(1))
    sensed = laboratory.measured(true, np.random.default_rng(2))
    later = slice(2000, 12000)

    def lag(name):
        reference = true[name][later]
        shifts = range(12)
        moved = [float(np.dot(sensed[name][2000 + k : 12000 + k], reference)) for k in shifts]
        return int(np.argmax(moved))

    assert lag("axial") == lag("load_cell_force") == lag("torsional")
    # the delay of a fourth-order Butterworth filter far below its cut-off, 2.613 / (2 pi 100 Hz) = 4.2 ms
    assert lag("axial") == 4
    rate = sensed["axial_velocity"]
    assert 0.9 < float(rate[later].std() / true["axial_velocity"][later].std()) < 1.1


@pytest.mark.parametrize(
    ("identifier", "failing"),
    [
        ("A1", 0),
        # the loops of Fig 2.10 a, which do not coincide: nothing in the rig wears
        pytest.param("A3", 1, marks=pytest.mark.slow),
        # the typing slip of eq 5.52
        pytest.param("D1", 1, marks=pytest.mark.slow),
        # the spring that the printed deck lacks
        pytest.param("D4", 1, marks=pytest.mark.slow),
    ],
)
def test_a_quick_item_comes_out_as_its_rows_say(identifier, failing):
    item = ENTRIES[identifier].run(silent)
    lost = [row for row in item.rows if row.holds is False]
    assert len(lost) == failing
    assert all(row.why for row in lost)
    assert any(row.holds for row in item.rows)
    assert len({picture.name for picture in item.pictures}) == len(item.pictures) >= 1
    for picture in item.pictures:
        assert any(axes.get_xlabel() for axes in picture.figure.axes)
