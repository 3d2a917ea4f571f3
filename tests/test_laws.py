"""The catalogue of force laws: one contract over all of them, their symmetry and their energy."""

from __future__ import annotations

import inspect
import json
import keyword
import math
import pickle
import subprocess
import sys

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_states import call, force_at, last_cycle_work, motion_of, random_state
from scipy.integrate import trapezoid

from bench.errors import ParameterError, UnknownNameError
from bench.laws import LAWS, describe, find_law, generalised_bouc_wen_law, iwan_law
from bench.laws.bouc_wen_variants import MAX_POWERS
from bench.laws.evaluate import evaluate
from bench.laws.jenkins import MAX_SLIDERS

ALL = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


@ALL
def test_description_is_complete_and_json(law):
    document = json.loads(json.dumps(describe(law), allow_nan=False))
    assert document["name"] == law.name == next(name for name, entry in LAWS.items() if entry is law)
    for key in ("equation", "reference", "documentation"):
        assert len(document[key]) > 3, key
    assert any(character.isdigit() for character in law.reference)  # a year
    for parameter in document["parameters"]:
        assert parameter["description"]
        name = parameter["name"]
        assert name.isidentifier()  # parameters are given by keyword
        assert not keyword.iskeyword(name)
    assert len(set(law.parameter_names)) == len(law.parameters)


@ALL
def test_units_are_known_and_forces_come_out(law):
    units = pint.UnitRegistry()
    for parameter in law.parameters:
        assert units.parse_units(parameter.unit) is not None
        if parameter.rotational is not None:
            assert units.parse_units(parameter.rotational) != units.parse_units(parameter.unit)
    for state in law.states:
        units.parse_units(state[state.index("[") + 1 : -1])


@ALL
def test_default_theta_is_valid_and_has_the_header_first(law):
    theta = law.theta()
    assert theta.shape == (len(law.header) + len(law.parameters),)
    assert tuple(theta[: len(law.header)]) == law.header
    np.testing.assert_array_equal(law.theta(theta), theta)
    assert law.start().shape == (len(law.states),)


@ALL
def test_kernels_have_the_common_signature(law):
    assert list(inspect.signature(law.force.function).parameters) == ["t", "q", "v", "z", "theta", "f"]
    if law.rate is not None:
        assert list(inspect.signature(law.rate.function).parameters) == ["t", "q", "v", "z", "theta", "zdot"]


@ALL
def test_force_adds_and_leaves_inputs_alone(law):
    rng = np.random.default_rng(1)
    t, q, v, z = random_state(law, rng)
    alone = call(law.force, t, q, v, z, law.theta(), np.zeros(law.n_coordinates))
    before = rng.normal(size=law.n_coordinates)
    added = call(law.force, t, q, v, z, law.theta(), before.copy())
    # one rounding a coordinate, relative to the larger of the two summands
    np.testing.assert_allclose(added, before + alone, rtol=1e-14, atol=1e-14 * np.abs(alone).max())
    if law.n_inputs:
        np.testing.assert_array_equal(added[-law.n_inputs :], before[-law.n_inputs :])


@ALL
def test_compiled_equals_source(law):
    rng = np.random.default_rng(2)
    for _ in range(200):
        t, q, v, z = random_state(law, rng)
        for compiled, size in ((law.force, law.n_coordinates), (law.rate, len(law.states))):
            if compiled is None:
                continue
            fast = call(
                compiled, t, q, v, z, law.theta(), np.full(size, 0.0 if compiled is law.force else np.nan)
            )
            slow = np.zeros(size)
            compiled(t, q, v, z, law.theta(), slow)
            assert np.all(np.isfinite(fast))  # also: a rate writes every state
            # the two libms may differ by an ulp, which a cancellation of terms of the size of the largest can blow up
            np.testing.assert_allclose(fast, slow, rtol=1e-15, atol=1e-15 * max(1.0, np.abs(slow).max()))


STATED_AT_REST = {"constant_force": 1.0}
BY_THE_CLOCK = {"harmonic_force"}


@ALL
def test_force_at_rest_is_the_stated_one(law):
    for t in () if law.name in BY_THE_CLOCK else (0.0, 3.7):
        expected = np.full(law.n_coordinates, STATED_AT_REST.get(law.name, 0.0))
        np.testing.assert_array_equal(force_at(law, 0.0, t=t), expected)
    if law.rate is not None:
        rate = call(
            law.rate, 0.0, np.zeros(1), np.zeros(1), law.start(), law.theta(), np.ones(len(law.states))
        )
        np.testing.assert_array_equal(rate, np.zeros(len(law.states)))


@ALL
def test_smoothness_is_as_stated(law):
    """Zoom into the largest jump along random lines: it vanishes for a continuous law and stays for a jump."""
    rng = np.random.default_rng(3)
    theta = law.theta()
    largest_left = 0.0
    for _ in range(8):
        a, b = (random_state(law, rng) for _ in range(2))
        low, high = 0.0, 1.0
        first = None
        for _ in range(8):
            fractions = np.linspace(low, high, 33)
            values = np.array(
                [
                    call(
                        law.force,
                        *((1 - s) * np.asarray(x) + s * np.asarray(y) for x, y in zip(a, b, strict=True)),
                        theta,
                        np.zeros(law.n_coordinates),
                    )
                    for s in fractions
                ]
            )
            jumps = np.abs(np.diff(values, axis=0)).max(axis=1)
            i = int(np.argmax(jumps))
            first = np.ptp(values) if first is None else first
            low, high = fractions[i], fractions[i + 1]
        largest_left = max(largest_left, jumps.max() / (first + 1e-300))
    # the last interval is 1e-12 of the line; the steepest law has a slope of some 1e3 of its range a line
    assert (largest_left > 1e-3) == (law.smoothness == "discontinuous")


@ALL
def test_laws_survive_pickling(law):
    copy = pickle.loads(pickle.dumps(law))
    assert copy.name == law.name
    assert copy.force is law.force
    assert copy.rate is law.rate


def test_unknown_law_names_the_near_one():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'bouc_wen'\?"):
        find_law("boucwen")
    with pytest.raises(UnknownNameError, match="clearance"):
        LAWS["gap"].theta(clearence=1.0)


def test_sized_laws_are_found_by_header():
    assert find_law("iwan", (25.0,)) is iwan_law(25)
    assert find_law("generalised_bouc_wen", [3]) is generalised_bouc_wen_law(3)
    assert find_law("iwan") is LAWS["iwan"]
    assert len(generalised_bouc_wen_law(2).parameters) == 7  # the dissertation's count for N = 2
    for bad in (("gap", (3,)), ("iwan", (2.5,)), ("iwan", (0,)), ("iwan", (MAX_SLIDERS + 1,))):
        with pytest.raises(ParameterError):
            find_law(*bad)
    with pytest.raises(ParameterError):
        generalised_bouc_wen_law(MAX_POWERS + 1)


@pytest.mark.parametrize(
    ("name", "bad"), [("gap", {"clearance": -1.0}), ("coulomb", {"limit": math.nan}), ("iwan", {"chi": -1.0})]
)
def test_parameters_out_of_bounds_are_refused(name, bad):
    with pytest.raises(ParameterError, match=next(iter(bad))):
        LAWS[name].theta(**bad)


def test_importing_the_laws_is_light():
    code = (
        "import sys, bench.laws; print([m for m in ('numba', 'mujoco', 'scipy', 'pint') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


NOT_ODD = {
    "asymmetric_gap",
    "asymmetric_damping",
    "one_sided_stop",
    "quadratic_stiffness",
    "constant_force",
    "timed_force",
    "harmonic_force",
    "asymmetric_coulomb",
    "printed_coupling",
}


@ALL
def test_odd_symmetry_where_due(law):
    if law.n_inputs:  # the input keeps its sign
        t, q, v = motion_of(law)
        mirrored = (t, q * [-1, 1], v * [-1, 1])
    else:
        t, q, v = motion_of(law)
        mirrored = motion_of(law, -1.0)
    forward = evaluate(law, law.theta(), t, q, v).force
    backward = evaluate(law, law.theta(), *mirrored).force
    scale = np.abs(forward).max()
    error = np.abs(forward + backward).max() / scale
    # sign changes are exact in floating point; 1e-12 leaves room for a different order of additions only
    assert (error < 1e-12) == (law.name not in NOT_ODD)


CONSERVATIVE = {
    "gap",
    "asymmetric_gap",
    "one_sided_stop",
    "quadratic_stiffness",
    "cubic_stiffness",
    "cogging",
    "constant_force",
    "cross_stiffness",
}
NOT_PASSIVE = {
    "stiffness_drift",
    "printed_coupling",
    "timed_force",
    "harmonic_force",
}  # time-dependent spring and forces; the printed form may feed energy in


@ALL
def test_work_over_a_cycle(law):
    work, peak_power = last_cycle_work(law)
    if law.name in CONSERVATIVE:
        # the trapezoidal rule over a full period converges fast, down to kinks: O(1/2000^2)
        assert abs(work) < 1e-5 * peak_power
    elif law.name not in NOT_PASSIVE:
        assert work > 1e-3 * peak_power


DISSIPATIVE = sorted(set(LAWS) - CONSERVATIVE - NOT_PASSIVE)


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(DISSIPATIVE),
    amplitudes=st.lists(st.floats(0.05, 1.0), min_size=1, max_size=3),
    seed=st.integers(0, 2**32 - 1),
)
def test_no_energy_from_passive_laws_over_closed_motion(name, amplitudes, seed):
    """Any periodic motion, not only a harmonic one, costs work once the hidden states are periodic too."""
    law = LAWS[name]
    rng = np.random.default_rng(seed)
    samples = 1000
    t = np.arange(4 * samples + 1) / samples
    scale = np.array([0.01, 0.4]) if law.n_coordinates == 2 and not law.n_inputs else np.array([0.01])
    q = np.zeros((t.size, scale.size))
    v = np.zeros_like(q)
    for harmonic_number, amplitude in enumerate(amplitudes, start=1):
        w = 2 * math.pi * harmonic_number
        phase = rng.uniform(0, 2 * math.pi, scale.size)
        q += scale * amplitude * np.sin(w * t[:, None] + phase)
        v += scale * amplitude * w * np.cos(w * t[:, None] + phase)
    positions, velocities = q, v
    if law.n_inputs:
        positions = np.column_stack([q, np.full(t.size, 10.0)])
        velocities = np.column_stack([v, np.zeros(t.size)])
    moving = law.n_coordinates - law.n_inputs
    force = evaluate(law, law.theta(), t, positions, velocities).force[-samples - 1 :, :moving]
    power = np.sum(force * v[-samples - 1 :], axis=1)
    # the trapezoidal rule errs by about 1/1000^2 of the peak power at kinks; degradation leaves the loop open by its rate
    assert trapezoid(power, t[-samples - 1 :]) >= -1e-4 * np.abs(power).max()
