"""The clock of a recording: found, refused where it is not uniform, repaired where asked."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.errors import RecordingError
from bench.recording import Channel, Recording
from bench.recording.clock import (
    CLOCK_SETTINGS,
    uniform_clock,
)

# The clock


@given(
    st.sampled_from([1000.0, 1024.0, 610.3515625, 44100.0, 1.0 / 3.0, 0.1, 12800.0, 2.0e5 / 3.0]),
    st.floats(-1e3, 1e5),
    st.integers(2, 3000),
)
@settings(max_examples=200, deadline=None)
def test_clock_is_found(rate, start, n):
    found_start, found = uniform_clock(start + np.arange(n) / rate)
    assert found_start == start
    # times near 1e5 s are exact to 1.5e-11 s; a few such errors spread over the whole record
    assert found == pytest.approx(
        rate, rel=1e-13 + 2e-10 * max(rate, 1.0) / (n - 1) * max(abs(start), 1.0) / 1e5
    )


@given(st.sampled_from([100.0, 1000.0, 1024.0, 2048.0]), st.integers(100, 20000))
@settings(max_examples=50, deadline=None)
def test_printed_times_give_the_rate_that_was_meant(rate, n):
    time = np.array([float(f"{t:.6f}") for t in np.arange(n) / rate])
    record = Recording.from_arrays(time, {"x": np.zeros(n)}, units={"x": "m"})
    assert record.sample_rate == rate
    np.testing.assert_array_equal(record.time, np.arange(n) / rate)


def test_clock_of_a_simulation():
    record = Recording(np.arange(5000) * (4 * 0.00025), np.zeros((5000, 1)), (Channel("x", "m"),))
    assert record.sample_rate == 1000.0
    assert record.duration == pytest.approx(4.999, rel=1e-15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: np.delete(t, [50, 51, 70]),
            r"3 samples missing \(2 after t = 0.049 s, 1 after t = 0.069 s\)",
        ),
        (lambda t: np.delete(t, np.arange(5, 95, 9)), "10 samples missing .* and 5 more gaps"),
        (
            lambda t: np.where(np.arange(100) == 12, t[11], t),
            "stands still: t = 0.011 s comes twice, at samples 11 and 12",
        ),
        (lambda t: np.concatenate([t[:50], t[:50]]), "backwards: from t = 0.049 s to 0 s at sample 50"),
        (lambda t: np.where(np.arange(100) == 12, np.nan, t), "time is not finite at sample 12"),
        (
            lambda t: t + 2e-5 * (np.arange(100) == 30),
            "sample 30 at t = 0.03002 s lies 2 % of a step off a clock of 1000 Hz",
        ),
        (lambda t: t**1.1, "not uniform|samples? missing"),
        (lambda t: t[:1], "n >= 2"),
        (lambda t: t[:, None], r"\(100, 1\)"),
        (lambda t: np.array(["a"] * 100), "no numbers"),
    ],
)
def test_bad_clocks_are_named(change, message):
    time = change(np.arange(100) / 1000.0)
    with pytest.raises(RecordingError, match=message):
        Recording.from_arrays(time, {"x": np.zeros(np.size(time))}, units={"x": "m"})


def test_jitter_can_be_allowed():
    rng = np.random.default_rng(1)
    time = (np.arange(1000) + rng.uniform(-0.05, 0.05, 1000)) / 1000.0
    with pytest.raises(RecordingError, match="not uniform"):
        Recording.from_arrays(time, {"x": time}, units={"x": "s"})
    record = Recording.from_arrays(time, {"x": time}, units={"x": "s"}, jitter=0.2)
    # the rate is known from two ends, each off by up to 0.05 of 999 steps
    assert record.sample_rate == pytest.approx(1000.0, rel=1.1e-4)
    with pytest.raises(RecordingError, match="not uniform"):
        Recording.from_arrays(time, {"x": time}, units={"x": "s"}, sample_rate=1010.0, jitter=0.2)


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf])
def test_a_clock_needs_a_rate(rate):
    with pytest.raises(RecordingError, match="sample_rate"):
        Recording.from_arrays(None, {"x": [0.0, 1.0]}, units={"x": "m"}, sample_rate=rate)


# Repair


def test_dropped_samples_are_bridged_and_reported():
    t = np.arange(400) / 1000.0
    x = np.sin(2 * np.pi * 5 * t)
    kept = np.setdiff1d(np.arange(400), [50, 51, 52, 200])
    x_lost = x.copy()
    x_lost[300] = np.nan
    record = Recording.from_arrays(
        t[kept],
        {"x": x_lost[kept], "y": x[kept]},
        units={"x": "m", "y": "m"},
        gaps="interpolate",
        meta={"a": 1},
    )
    np.testing.assert_array_equal(record.time, t)
    there = np.setdiff1d(kept, [300])
    np.testing.assert_array_equal(record["x"][there], x[there])
    # PCHIP errs by at most h^2 |x''| / 8 near a peak, here with h = 4 ms and x'' = (2 pi 5)^2
    np.testing.assert_allclose(record["x"], x, atol=(4e-3 * 2 * np.pi * 5) ** 2 / 8)
    assert np.max(np.abs(record["y"])) <= np.max(np.abs(x[kept]))
    assert record.meta["a"] == 1
    assert record.meta["repaired"] == {
        "method": "pchip",
        "missing_samples": 4,
        "gaps": ((0.049, 3), (0.199, 1)),
        "values": {"x": 1},
    }


def test_a_sound_record_is_not_touched_by_repair():
    t = np.arange(100) / 1000.0
    record = Recording.from_arrays(t, {"x": t}, units={"x": "m"}, gaps="interpolate")
    assert record == Recording.from_arrays(t, {"x": t}, units={"x": "m"})
    assert "repaired" not in record.meta


def test_what_cannot_be_bridged_is_refused():
    t = np.arange(100) / 100.0
    units = {"x": "m"}
    long = np.delete(t, np.arange(20, 21 + CLOCK_SETTINGS.longest_repair))
    with pytest.raises(RecordingError, match=r"11 successive samples are lost after t = 0.19 s"):
        Recording.from_arrays(long, {"x": long}, units=units, gaps="interpolate")
    for place in (0, -1):
        x = t.copy()
        x[place] = np.nan
        with pytest.raises(RecordingError, match="cut them off"):
            Recording.from_arrays(t, {"x": x}, units=units, gaps="interpolate")
    with pytest.raises(RecordingError, match="gaps is 'fill'"):
        Recording.from_arrays(t, {"x": t}, units=units, gaps="fill")
