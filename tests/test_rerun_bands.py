"""Bands of contact and of stick and slip: as geometry and exact sliders say."""

from __future__ import annotations

import numpy as np
import pytest

from bench import Element, Recording
from bench.laws import LAWS
from bench.rerun_log.bands import (
    BANDS_SETTINGS,
    changes,
    element_bands,
)


def sine(amplitude: float, n: int = 100_000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = (np.arange(n) + 0.5) / n
    return t, amplitude * np.sin(2.0 * np.pi * t), 2.0 * np.pi * amplitude * np.cos(2.0 * np.pi * t)


def record_of(element: str, t, x, v, r) -> Recording:
    names = {f"{element}/displacement": x, f"{element}/velocity": v, f"{element}/force": r}
    units = dict(zip(names, ("m", "m/s", "N"), strict=True))
    return Recording.from_arrays(t, names, units=units)


def test_a_gap_is_in_contact_for_the_share_of_a_sine_that_geometry_says():
    gap = Element.of("gap", "carriage", clearance=0.3, offset=0.1, name="gap")
    (band,) = element_bands(gap)
    t, x, v = sine(1.0)
    states = band.of(record_of("gap", t, x, v, x))
    assert states is not None
    # Above 0.4: (pi - 2 asin 0.4) / 2 pi; below -0.2: (pi - 2 asin 0.2) / 2 pi. One sample in 1e5 at each of 4 edges.
    assert np.mean(states == 2) == pytest.approx(0.5 - np.arcsin(0.4) / np.pi, abs=4e-5)
    assert np.mean(states == 0) == pytest.approx(0.5 - np.arcsin(0.2) / np.pi, abs=4e-5)
    np.testing.assert_array_equal(states[changes(states)], [1, 2, 1, 0, 1])


def test_a_one_sided_stop_never_touches_the_other_side():
    (band,) = element_bands(Element.of("one_sided_stop", "carriage", position=-0.2, side=-1.0, name="stop"))
    t, x, v = sine(1.0)
    states = band.of(record_of("stop", t, x, v, x))
    np.testing.assert_array_equal(states == 0, x < -0.2)
    assert not np.any(states == 2)


def test_coulomb_friction_sticks_below_its_regularisation_velocity():
    (band,) = element_bands(Element.of("coulomb", "carriage", regularisation_velocity=0.5, name="slide"))
    t, x, v = sine(1.0)
    np.testing.assert_array_equal(band.of(record_of("slide", t, x, v, x)) == 0, np.abs(v) < 0.5)


def test_a_jenkins_slider_slips_from_the_yield_of_each_half_cycle_to_its_reversal():
    amplitude, yield_at, limit = 1.0, 0.2, 5.0
    (band,) = element_bands(
        Element.of("jenkins", "carriage", stiffness=limit / yield_at, limit=limit, name="slide")
    )
    t, x, v = sine(amplitude)
    spring, r = 0.0, []
    for step in np.diff(x, prepend=0.0):  # the exact return map of an elastic, perfectly plastic slider
        spring = np.clip(spring + limit / yield_at * step, -limit, limit)
        r.append(spring)
    states = band.of(record_of("slide", t, x, v, np.array(r)))
    # After a reversal at +A the force falls from +Fy; it reaches -0.9 Fy when the slider has gone back 1.9 Fy/k.
    elastic = (1.0 + BANDS_SETTINGS.slip_share) * yield_at
    start = 0.25 + np.arccos((amplitude - elastic) / amplitude) / (2.0 * np.pi)
    half = (t > 0.25) & (t < 0.75)
    np.testing.assert_array_equal(states[half] == 1, t[half] > start)


def test_bands_of_every_law_read_channels_that_the_law_has():
    quiet = 0
    for law in LAWS.values():
        names = tuple(f"joint_{i}" for i in range(law.n_coordinates - law.n_inputs))
        element = Element.of(law, *names, inputs=("load",) * law.n_inputs, name="e")
        suffixes = [""] if len(names) == 1 else [f"_{i + 1}" for i in range(len(names))]
        held = {f"e/{motion}{s}" for motion in ("displacement", "velocity", "force") for s in suffixes}
        held |= {f"e/{state.partition(' [')[0]}" for state in law.states}
        bands = element_bands(element)
        assert {channel for band in bands for channel in band.channels} <= held, law.name
        assert len({band.name for band in bands}) == len(bands), law.name
        quiet += not bands
    assert 0 < quiet < len(LAWS)


def test_friction_and_gap_laws_all_have_bands():
    for name in (
        "gap",
        "asymmetric_gap",
        "one_sided_stop",
        "coulomb",
        "stribeck",
        "dahl",
        "lugre",
        "jenkins",
        "iwan",
    ):
        assert element_bands(Element.of(name, "carriage")), name
    assert len(element_bands(Element.of("axial_torsional_joint", "axial", "torsional"))) == 2
    assert len(element_bands(Element.of("jenkins_backlash", "carriage"))) == 2
