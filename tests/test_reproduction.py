"""The reproduction: its registry, its bookkeeping, the small solvers its items bring, and the quick items whole."""

from __future__ import annotations

import json
import math
from importlib import import_module

import numpy as np
import pytest

from bench.errors import UnknownNameError
from bench.reproduction import ENTRIES, Entry, Item, Result, find_entries, reproduce, running
from bench.reproduction.item import range_row, value_row


def names(*given):
    return [entry.identifier for entry in find_entries(given)]


def silent(label, share):
    assert 0.0 <= share <= 1.0


def test_items_are_found_by_name_chapter_and_alias():
    assert names() == list(ENTRIES)
    assert names("b") == ["B1", "B2", "B3"]
    assert names("d4", "A1", "a1") == ["A1", "D4"]
    assert names("C1", "D2") == ["C2", "D3"]
    with pytest.raises(UnknownNameError, match="E7"):
        find_entries(["A1", "E7"])


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))
def test_every_item_can_be_run(entry):
    assert callable(import_module(f"bench.reproduction.{entry.module}").run)
    assert entry.weight > 0.0


def test_a_range_holds_only_if_both_of_its_ends_do():
    assert range_row("x", "in", 1.0, [-0.9, 0.0, 1.1]).holds is True
    row = range_row("x", "in", 1.0, [-0.8, 0.0, 1.1])
    assert row.holds is False
    assert row.deviation == pytest.approx(-20.0)
    assert range_row("x", "in", 1.0, [0.2, 1.0]).holds is False


def test_a_value_holds_between_its_limits_and_is_only_reported_without():
    assert value_row("n", "1", 2.0, 2.1, low=1.9, high=2.2).holds is True
    assert value_row("n", "1", 2.0, 2.3, high=2.2).holds is False
    assert value_row("n", "1", None, math.nan, high=2.2).holds is False
    assert value_row("n", "1", 2.0, 2.3).holds is None
    assert value_row("n", "1", 2.0, 2.3).deviation == pytest.approx(15.0)


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
            value_row("speed | size", "m/s", 2.0, 2.1, high=2.2),
            value_row("<b>", "", None, 1.0),
        )
        return Item("One paragraph.\n\nAnother.", rows, (Picture("line", "A line.", figure),))


@pytest.fixture
def counting(monkeypatch):
    item = Counting()

    def run(entry, progress):
        return item.make(entry, progress)

    monkeypatch.setattr(Entry, "run", run)
    return item


def test_items_are_written_and_kept(tmp_path, counting, monkeypatch):
    out = tmp_path / "deep" / "out"
    first = reproduce(["A1", "A2"], out, progress=silent)
    assert counting.runs == ["A1", "A2"]
    assert all(path.is_file() for path in first.files)
    assert first.holds
    table = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert [item["identifier"] for item in table["items"]] == ["A1", "A2"]
    assert table["items"][0]["rows"][0]["ours"] == "2.1"
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
    from bench.reproduction.simulated_hysteresis import (
        SIMULATED_HYSTERESIS_SETUP,
        integrate,
    )

    n = 4000
    rows = integrate(np.full(n, 2.0), [np.array([5.0, 0.0, 0.0, 0.0, 0.0])] * n)
    time = np.arange(n) / SIMULATED_HYSTERESIS_SETUP.rate
    # RK4 at omega h = 2e-3: (omega h)^4 / 120 of a radian a radian, far below 1e-10
    np.testing.assert_allclose(rows[:, 0], 0.4 * (1.0 - np.cos(math.sqrt(5.0) * time)), atol=1e-10)
    np.testing.assert_allclose(rows[:, 2], 2.0 * np.cos(math.sqrt(5.0) * time), atol=1e-9)


def test_the_encoders_lag_as_the_load_cells_do():
    from bench.reproduction import laboratory_joint as laboratory
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
    "identifier",
    ["A1", *(pytest.param(name, marks=pytest.mark.slow) for name in ("A3", "A5", "D1", "D4"))],
)
def test_what_must_hold_of_a_quick_item_holds(identifier):
    item = ENTRIES[identifier].run(silent)
    assert [row for row in item.rows if row.holds is False] == []
    assert any(row.holds for row in item.rows)
    assert len({picture.name for picture in item.pictures}) == len(item.pictures) >= 1
    for picture in item.pictures:
        assert any(axes.get_xlabel() for axes in picture.figure.axes)
