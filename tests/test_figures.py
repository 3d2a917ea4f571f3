"""Figures: quantities and units on every axis, the data as given, no display, files whole or not at all."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from bench import Recording, figures
from bench.errors import BenchError, ParameterError, UnknownNameError

N, RATE = 4000, 500.0
UNITS = {"joint/displacement": "m", "joint/velocity": "m/s", "joint/force": "N", "load_cell": "N"}
CATEGORICAL = ("channel", "effect", "effects, in the order added")


def record(stiffness: float = 100.0) -> Recording:
    t = np.arange(N) / RATE
    x = 0.01 * np.sin(2.0 * np.pi * 3.0 * t)
    v = 0.01 * 2.0 * np.pi * 3.0 * np.cos(2.0 * np.pi * 3.0 * t)
    r = stiffness * x + 2.0 * v
    values = {"joint/displacement": x, "joint/velocity": v, "joint/force": r, "load_cell": r + 0.1}
    return Recording.from_arrays(t, values, units=UNITS, settle=1.0)


RECORDS = {"measured": record(), "network": record(101.0), "polynomial": record(150.0)}


NAMES = (
    *("time_histories", "error_histories", "loops", "phase_plot", "surface", "spectrum"),
    *("waterfall", "residual_map", "bar_table", "contributions"),
)


@cache
def every_figure() -> dict[str, Figure]:
    rng = np.random.default_rng(3)
    x, v = rng.normal(size=(2, 5000))
    channels = ["joint/force", "joint/displacement"]
    edges = np.linspace(-1.0, 1.0, 11)
    return {
        "time_histories": figures.time_histories(RECORDS, channels, window=(1.0, 3.0), title="a title"),
        "error_histories": figures.error_histories(RECORDS, channels),
        "loops": figures.loops(RECORDS, figures.element_loops(RECORDS["measured"], "joint")),
        "phase_plot": figures.phase_plot(RECORDS, "joint/displacement", "joint/velocity"),
        "surface": figures.surface(x, v, 2.0 * x + v),
        "spectrum": figures.spectrum(RECORDS, channels, max_frequency=50.0),
        "waterfall": figures.waterfall(["gap", "friction"], [10.0, 4.0, 5.0], floor=0.5),
        "residual_map": figures.residual_map(edges, edges, np.where(rng.random((10, 10)) < 0.3, np.nan, 1.0)),
        "bar_table": figures.bar_table(
            {"network": {"force": 0.1, "torque": 0.2}, "polynomial": {"force": 30.0}}, limit=0.5
        ),
        "contributions": figures.contributions(np.arange(5000) * 1e-3, {"spring": x, "damper": v}),
    }


@pytest.mark.parametrize("name", NAMES)
def test_every_axis_says_what_it_shows_in_which_unit(name):
    figure = every_figure()[name]
    for axes in figure.axes:
        bar = axes.get_label() == "<colorbar>"
        beside = {
            "x": axes.get_shared_x_axes().get_siblings(axes),
            "y": axes.get_shared_y_axes().get_siblings(axes),
        }
        for direction in "y" if bar else "xy":
            # Of axes above each other with one clock, the lowest is labelled for all.
            labels = {getattr(other, f"get_{direction}label")() for other in beside[direction]} - {""}
            assert len(labels) == 1, f"{name}: {direction} {labels}"
            label = labels.pop()
            assert label in CATEGORICAL or re.search(r"\S+ ?.* \[.+\]$", label), f"{name}: '{label}'"


def test_all_public_figures_are_looked_at_here():
    other = {"COLOURS", "as_png_data_uri", "as_svg", "element_loops", "save", "style"}
    assert set(NAMES) == set(every_figure()) == set(figures.__all__) - other


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_becomes_a_picture_and_an_svg(name, tmp_path):
    figure = every_figure()[name]
    path = figures.save(figure, tmp_path / "folder" / f"{name}.png", dpi=40)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    svg = figures.as_svg(figure)
    assert svg.startswith("<svg")
    assert svg.rstrip().endswith("</svg>")


def test_data_address_holds_the_png():
    import base64

    address = figures.as_png_data_uri(
        figures.phase_plot(RECORDS, "joint/displacement", "joint/velocity"), dpi=40
    )
    head, content = address.split(",")
    assert head == "data:image/png;base64"
    assert base64.b64decode(content, validate=True).startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_same_figure_gives_the_same_file(tmp_path):
    for suffix in ("png", "svg", "pdf"):
        files = [
            figures.save(figures.waterfall(["gap"], [2.0, 1.0]), tmp_path / f"{i}.{suffix}").read_bytes()
            for i in range(2)
        ]
        assert files[0] == files[1]


@pytest.mark.slow
def test_figures_need_neither_pyplot_nor_a_display():
    code = (
        "import sys, os; os.environ.pop('DISPLAY', None); os.environ['MPLBACKEND'] = 'tkagg'\n"
        "from bench import figures\n"
        "figures.as_svg(figures.waterfall(['gap'], [2.0, 1.0]))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_the_users_own_settings_are_left_alone():
    before = dict(matplotlib.rcParams)
    figures.as_svg(figures.surface([0.0, 1.0], [0.0, 1.0], [1.0, 2.0]))
    with figures.style():
        pass
    assert dict(matplotlib.rcParams) == before


def test_time_histories_draw_the_samples_of_the_window():
    figure = figures.time_histories(RECORDS, ["joint/force"], window=(1.0, 3.0))
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == list(RECORDS)
    first = RECORDS["measured"]
    inside = (first.time >= 1.0) & (first.time < 3.0)
    np.testing.assert_array_equal(axes.lines[0].get_xdata(), first.time[inside])
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), first["joint/force"][inside])


def test_a_long_record_is_thinned_without_losing_an_impact():
    t = np.arange(300_000) * 1e-4
    y = np.zeros_like(t)
    y[123_456] = 9.0
    long = Recording.from_arrays(t, {"force": y}, units={"force": "N"})
    (axes,) = figures.time_histories({"measured": long}, ["force"]).axes
    x, drawn = axes.lines[0].get_data()
    assert len(drawn) <= 20_002
    assert x[np.argmax(drawn)] == pytest.approx(12.3456)


def test_error_histories_state_the_nmse_of_the_scored_part():
    (axes,) = figures.error_histories(RECORDS, ["joint/force"], window=(2.0, 3.0)).axes
    y, yhat = (RECORDS[name]["joint/force"][500:] for name in ("measured", "network"))
    expected = 100.0 * np.mean((y - yhat) ** 2) / np.var(y)
    assert axes.lines[0].get_label() == f"network: NMSE {expected:.3g} %"


def test_surface_shows_the_mean_force_where_there_are_data_and_nothing_elsewhere():
    rng = np.random.default_rng(0)
    x, v = rng.uniform(-1.0, 1.0, size=(2, 200_000))
    keep = x**2 + v**2 < 1.0
    x, v = x[keep], v[keep]
    figure = figures.surface(x, v, 3.0 * x - 2.0 * v, bins=20)
    mean = np.ma.filled(figure.axes[0].collections[0].get_array().astype(float), np.nan)
    count = np.ma.filled(figure.axes[1].collections[0].get_array().astype(float), 0.0)
    assert count.sum() == len(x)
    middle = np.linspace(-1.0, 1.0, 41)[1::2]
    inside = np.hypot(*np.meshgrid(middle, middle)) < 0.85
    expected = 3.0 * middle[None, :] - 2.0 * middle[:, None]
    # 400 samples a cell of width 0.1: the mean's spread is 0.1/sqrt(12) * 3.6 / 20 = 5e-3; five of these. The data's own
    # edges lie within 1e-4 of -1 and 1.
    assert np.abs(mean - expected)[inside].max() < 2.6e-2
    assert np.isnan(mean[0, 0])
    assert count[0, 0] == 0.0


def test_spectrum_of_white_noise_is_flat_at_its_density():
    rng = np.random.default_rng(1)
    noise = Recording.from_arrays(
        np.arange(200_000) / RATE, {"force": 2.0 * rng.normal(size=200_000)}, units={"force": "N"}
    )
    (axes,) = figures.spectrum({"noise": noise}, ["force"]).axes
    frequency, density = axes.lines[0].get_data()
    assert axes.get_ylabel() == "force [N/√Hz]"
    assert frequency.max() == pytest.approx(RATE / 2.0)
    # One-sided density sigma sqrt(2/fs); the mean over 2e4 lines of a spread of a fifth is within 0.5 %, the bias of a
    # square root of an average over eight segments -2 %.
    assert density.mean() == pytest.approx(2.0 * np.sqrt(2.0 / RATE), rel=0.03)


def test_waterfall_bars_span_the_steps_between_levels():
    (axes,) = figures.waterfall(["gap", "friction"], [10.0, 4.0, 5.0]).axes
    spans = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in axes.patches]
    assert spans == [(0.0, 10.0), (4.0, 10.0), (4.0, 5.0), (0.0, 5.0)]
    assert axes.patches[1].get_facecolor() != axes.patches[2].get_facecolor()


def test_contributions_share_out_the_whole():
    t = np.arange(1000) * 1e-3
    parts = {
        "spring": np.sin(40.0 * t),
        "damper": 2.0 * np.cos(40.0 * t),
        "friction": 0.3 * np.sign(np.cos(40.0 * t)),
    }
    bars = figures.contributions(t, parts).axes[1].patches
    assert sum(bar.get_width() for bar in bars) == pytest.approx(100.0, rel=1e-12)
    assert bars[1].get_width() > bars[0].get_width()


def test_bad_arguments_are_refused_with_what_to_do():
    ones = np.ones(3)
    short = Recording.from_arrays(
        RECORDS["measured"].time[:100], {"load_cell": np.arange(100.0)}, units={"load_cell": "N"}
    )
    cases = [
        (lambda: figures.time_histories({}, ["load_cell"]), ParameterError, "no records"),
        (lambda: figures.time_histories(RECORDS, []), ParameterError, "no channels"),
        (lambda: figures.time_histories(RECORDS, ["joint/farce"]), UnknownNameError, "joint/force"),
        (
            lambda: figures.time_histories(RECORDS, ["load_cell"], window=(90.0, 91.0)),
            ParameterError,
            "window inside",
        ),
        (
            lambda: figures.error_histories({"a": RECORDS["measured"]}, ["load_cell"]),
            ParameterError,
            "reference",
        ),
        (
            lambda: figures.error_histories({"a": RECORDS["measured"], "b": short}, ["load_cell"]),
            ParameterError,
            "4000 and 100 samples",
        ),
        (lambda: figures.loops(RECORDS, []), ParameterError, "pairs"),
        (lambda: figures.element_loops(RECORDS["measured"], "joynt"), UnknownNameError, "joint"),
        (lambda: figures.surface(ones, ones, np.ones(2)), ParameterError, r"\[3, 3, 2\]"),
        (lambda: figures.surface(ones, ones, ones * np.nan), ParameterError, "finite"),
        (lambda: figures.spectrum(RECORDS, []), ParameterError, "no channels"),
        (lambda: figures.waterfall(["gap"], [1.0]), ParameterError, "one finite value more"),
        (lambda: figures.residual_map(ones, ones, ones), ParameterError, "edges"),
        (lambda: figures.bar_table({}), ParameterError, "no scores"),
        (lambda: figures.contributions(ones, {}), ParameterError, "parts"),
        (lambda: figures.contributions(ones, {"a": np.ones(2)}), ParameterError, r"\(2,\)"),
    ]
    for call, error, words in cases:
        with pytest.raises(error, match=words):
            call()


def test_a_figure_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    figure = figures.waterfall(["gap"], [2.0, 1.0])
    with pytest.raises(ParameterError, match=r"\.png, \.svg or \.pdf"):
        figures.save(figure, tmp_path / "figure.bmp")
    with pytest.raises(BenchError, match="cannot write"):
        figures.save(figure, "/proc/nowhere/figure.png")
    path = tmp_path / "figure.png"
    path.write_bytes(b"old")

    def broken(*_arguments, **_settings):
        raise RuntimeError("drawing failed")

    monkeypatch.setattr(Figure, "savefig", broken)
    with pytest.raises(RuntimeError, match="drawing failed"):
        figures.save(figure, path)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["figure.png"]
