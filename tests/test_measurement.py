"""Measurement chains: each stage against its formula, any split into blocks against the whole record, bad input."""

from __future__ import annotations

import copy
import json
import pickle
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import butter, sosfilt, sosfilt_zi

from bench.errors import ParameterError, UnknownNameError
from bench.measurement import (
    ORDER,
    STAGES,
    AntiAlias,
    Bias,
    Chain,
    Clipping,
    Delay,
    Drift,
    Gain,
    Lag,
    Noise,
    Quantisation,
    Stage,
    measure,
)
from bench.recording import Recording

RATE = 1000.0
EXAMPLES = {
    "anti_alias": AntiAlias(120.0, order=5),
    "delay": Delay(0.0123),
    "lag": Lag(0.004),
    "gain": Gain(1.03),
    "bias": Bias(-0.2),
    "drift": Drift(0.1, random_walk=0.02),
    "noise": Noise(0.05),
    "quantisation": Quantisation(0.01),
    "clipping": Clipping(-0.8, 0.9),
}
FULL = Chain(*(EXAMPLES[stage.name] for stage in ORDER))


def generator(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture
def x() -> np.ndarray:
    return generator(11).standard_normal(2000)


@pytest.mark.parametrize("order", [1, 2, 5, 8])
@pytest.mark.parametrize("before", ["zero", "steady"])
def test_anti_alias_filter_equals_scipy(x, order, before):
    sections = butter(order, 80.0, fs=RATE, output="sos")
    start = sosfilt_zi(sections) * (x[0] if before == "steady" else 0.0)
    expected = sosfilt(sections, x, zi=start)[0]
    measured = Chain(AntiAlias(80.0, order=order, before=before)).apply(x, RATE)
    # The same recursion in the same order: rounding of the last bits at most.
    np.testing.assert_allclose(measured, expected, rtol=0.0, atol=1e-12)


def test_anti_alias_filter_halves_the_power_at_its_cutoff():
    t = np.arange(4000) / RATE
    y = Chain(AntiAlias(100.0)).apply(np.sin(2 * np.pi * 100.0 * t), RATE)
    # Whole cycles after a transient that has died away below 1e-12.
    assert np.sqrt(2.0 * np.mean(y[2000:] ** 2)) == pytest.approx(np.sqrt(0.5), rel=1e-9)


@pytest.mark.parametrize(("time", "order"), [(0.003, 3), (0.0, 1), (0.5, 7)])
def test_whole_delays_are_exact(x, time, order):
    n = round(time * RATE)
    y = Chain(Delay(time, order=order)).apply(x, RATE)
    assert np.array_equal(y[n:], x[: x.size - n])
    assert np.all(y[:n] == x[0])
    assert np.all(Chain(Delay(time, before="zero")).apply(x, RATE)[:n] == 0.0)


@pytest.mark.parametrize("samples", [0.5, 1.5, 3.25, 17.9])
@pytest.mark.parametrize(("order", "points"), [(1, 1), (3, 2), (5, 3), (7, 4)])
def test_broken_delays_of_a_sine_are_within_the_interpolation_error(samples, order, points):
    omega = 2.0 * np.pi * 20.0
    t = np.arange(1000) / RATE
    y = Chain(Delay(samples / RATE, order=order)).apply(np.sin(omega * t), RATE)
    exact = np.sin(omega * (t - samples / RATE))
    base = max(0, int(samples) - (points - 1))
    nodes = samples - base - np.arange(order + 1)
    # Remainder of the polynomial through order + 1 samples: prod |d - k| / (order + 1)! times that derivative of the sine.
    bound = np.prod(np.abs(nodes)) / np.prod(np.arange(1, order + 2)) * (omega / RATE) ** (order + 1)
    settled = slice(base + order + 1, None)
    error = np.abs(y - exact)[settled].max()
    assert error <= bound + 1e-14
    assert error >= 0.5 * bound - 1e-14  # the bound is that of this polynomial, and not only a large number


def test_cubic_delay_error_at_ten_samples_a_cycle_is_as_documented():
    t = np.arange(1000) / RATE
    y = Chain(Delay(0.0025)).apply(np.sin(2 * np.pi * 100.0 * t), RATE)
    assert np.abs(y - np.sin(2 * np.pi * 100.0 * (t - 0.0025)))[10:].max() < 0.005


def test_lag_equals_the_differential_equation_for_straight_lines_between_samples():
    values = generator(3).standard_normal(40)
    t = np.arange(40) / RATE
    y = Chain(Lag(0.003)).apply(values, RATE)
    out = [values[0]]
    for k in range(39):  # step by step: the input has a kink at every sample
        span = (t[k], t[k + 1])
        solved = solve_ivp(
            lambda s, z, k=k: (np.interp(s, t[k : k + 2], values[k : k + 2]) - z) / 0.003,
            span,
            [out[-1]],
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
        )
        out.append(solved.y[0, -1])
    # 40 steps of an integrator at 1e-11.
    np.testing.assert_allclose(y, out, atol=1e-9)


def test_lag_is_of_second_order_in_the_sample_time():
    errors = []
    for rate in (500.0, 1000.0, 2000.0):
        t = np.arange(round(rate)) / rate
        omega, tau = 2 * np.pi * 5.0, 0.02
        y = Chain(Lag(tau)).apply(np.sin(omega * t), rate)
        gain, angle = 1.0 / np.hypot(1.0, omega * tau), np.arctan(omega * tau)
        errors.append(np.abs(y - gain * np.sin(omega * t - angle))[-round(rate / 5) :].max())
    # The transient exp(-0.8 / 0.02) has gone; halving the step quarters the error.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.05)


def test_gain_bias_and_steady_drift_are_their_formulas(x):
    y = Chain(Gain(2.0), Bias(3.0), Drift(0.5)).apply(x, RATE)
    np.testing.assert_allclose(y, 2.0 * x + 3.0 + 0.5 * np.arange(2000) / RATE, atol=1e-14)


def test_random_walk_has_independent_increments_of_the_stated_size():
    ends = []
    for stream in generator(5).spawn(400):
        y = Chain(Drift(random_walk=0.3)).apply(np.zeros(401), 100.0, stream)
        assert y[0] == 0.0
        ends.append(y[[100, 400]])
    # 400 draws give a standard deviation to 3.5 %; four of them.
    np.testing.assert_allclose(np.std(ends, axis=0), [0.3, 0.6], rtol=0.14)


def test_noise_is_white_and_of_the_stated_size():
    y = Chain(Noise(0.3)).apply(np.zeros(100_000), RATE, generator(2))
    assert y.mean() == pytest.approx(0.0, abs=4 * 0.3 / np.sqrt(1e5))
    assert y.std() == pytest.approx(
        0.3, rel=4 / np.sqrt(2e5)
    )  # four standard deviations of the estimate, as below
    for lag in (1, 2, 10):
        assert np.mean(y[lag:] * y[:-lag]) / 0.09 == pytest.approx(0.0, abs=4 / np.sqrt(1e5))


def test_quantiser_rounds_to_its_step():
    ramp = np.linspace(-1.0, 1.0, 100_001)
    y = Chain(Quantisation(0.01)).apply(ramp, RATE)
    np.testing.assert_allclose(y / 0.01, np.rint(y / 0.01), atol=1e-12)
    assert np.abs(y - ramp).max() <= 0.005 * (1.0 + 1e-12)
    # The error of a fine ramp is uniform, up to the half step that each end of the range lacks.
    assert np.std(y - ramp) == pytest.approx(0.01 / np.sqrt(12.0), rel=1e-3)
    assert Quantisation.from_bits(16, full_scale=10.0).step == 20.0 / 65536
    assert Chain(Quantisation(0.01)).noise_std == pytest.approx(0.01 / np.sqrt(12.0))


def test_clipping_limits_after_quantisation(x):
    y = Chain(Quantisation(0.3), Clipping(-1.0, 0.5)).apply(x, RATE)
    assert y.min() == -1.0
    assert y.max() == 0.5
    inside = (y > -1.0) & (y < 0.5)
    np.testing.assert_allclose(y[inside], 0.3 * np.rint(x[inside] / 0.3), atol=1e-15)


@settings(max_examples=60, deadline=None)
@given(
    names=st.sets(st.sampled_from(sorted(EXAMPLES))),
    sizes=st.lists(st.integers(0, 40), min_size=1, max_size=12),
    before=st.sampled_from(["steady", "zero"]),
    delay=st.sampled_from([0.0, 0.0004, 0.001, 0.0123, 0.4]),
    rate=st.sampled_from([500.0, 1000.0, 44_100.0]),
    seed=st.integers(0, 2**32),
)
def test_any_split_into_blocks_gives_the_same_bits(names, sizes, before, delay, rate, seed):
    stages = EXAMPLES | {
        "delay": Delay(delay, before=before),
        "lag": Lag(0.004, before=before),
        "anti_alias": AntiAlias(120.0, order=5, before=before),
    }
    chain = Chain(*(stages[stage.name] for stage in ORDER if stage.name in names))
    x = generator(seed).standard_normal(sum(sizes))
    whole = chain.apply(x, rate, generator(seed))
    for split in (sizes, [1] * x.size):
        state = chain.start(rate, generator(seed))
        edges = np.cumsum([0, *split])
        parts = [chain.process(state, x[a:b]) for a, b in pairwise(edges)]
        assert np.array_equal(np.concatenate([np.empty(0), *parts]), whole)


def test_order_of_the_stages_is_the_documented_one(x):
    by_hand = x
    streams_of_the_chain = FULL.apply(x, RATE, generator(9))
    for stage in ORDER:
        # One-stage chains share the stream of their stage with the whole chain: it is derived from the name of the stage.
        by_hand = Chain(EXAMPLES[stage.name]).apply(by_hand, RATE, generator(9))
    assert np.array_equal(streams_of_the_chain, by_hand)


def test_a_branch_of_a_state_goes_on_alike(x):
    state = FULL.start(RATE, generator(1))
    FULL.process(state, x[:700])
    branch = copy.deepcopy(state)
    assert np.array_equal(FULL.process(state, x[700:]), FULL.process(branch, x[700:]))


def test_chains_leave_their_input_alone_and_follow_their_seed(x):
    before = x.copy()
    first, again, other = (FULL.apply(x, RATE, generator(seed)) for seed in (1, 1, 2))
    assert np.array_equal(x, before)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.array_equal(Chain().apply(x, RATE), x)


def test_one_more_stage_does_not_change_the_noise(x):
    plain = Chain(Noise(0.1)).apply(x, RATE, generator(4))
    shifted = Chain(Bias(1.0), Drift(random_walk=0.1), Noise(0.1)).apply(x, RATE, generator(4))
    drift = Chain(Bias(1.0), Drift(random_walk=0.1)).apply(np.zeros(2000), RATE, generator(4))
    np.testing.assert_allclose(shifted - drift, plain, atol=1e-14)


def test_every_stage_is_in_the_order_and_has_an_example():
    assert set(STAGES) == set(EXAMPLES) == {stage.name for stage in ORDER}
    assert tuple(STAGES[name] for name in (stage.name for stage in ORDER)) == ORDER


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_contract_of_every_stage(name, x):
    chain = Chain(EXAMPLES[name])
    y = chain.apply(x, RATE, generator())
    assert y.shape == x.shape
    assert np.all(np.isfinite(y))
    assert not np.array_equal(y, x)
    assert chain.random == (name in ("drift", "noise"))
    again = Chain.from_dict(json.loads(json.dumps(chain.to_dict(), allow_nan=False)))
    assert again == chain
    assert hash(again) == hash(chain)
    assert np.array_equal(again.apply(x, RATE, generator()), y)
    assert pickle.loads(pickle.dumps(chain)) == chain


def test_full_chain_round_trip():
    assert Chain.from_dict(json.loads(json.dumps(FULL.to_dict()))) == FULL
    assert eval(repr(FULL)) == FULL


BAD = [
    (lambda: AntiAlias(-1.0), r"cutoff of stage 'anti_alias' is -1.0; .* above 0 \[Hz\]"),
    (lambda: AntiAlias(10.0, order=0), r"whole number from 1 to 20"),
    (lambda: AntiAlias(10.0, before="now"), r"one of 'steady', 'zero'"),
    (
        lambda: Chain(AntiAlias(600.0)).start(RATE),
        r"cut-off at 600 Hz, but the sample rate of 1000 Hz ends at 500 Hz",
    ),
    (lambda: Delay(-0.1), r"time of stage 'delay' is -0.1; .* at least 0 \[s\]"),
    (lambda: Delay(0.1, order=2), r"1, 3, 5 or 7"),
    (lambda: Lag(0.0), r"time_constant of stage 'lag'"),
    (lambda: Gain(0.0), r"other than 0"),
    (lambda: Bias(np.inf), r"finite number"),
    (lambda: Drift(random_walk=-1.0), r"random_walk of stage 'drift'"),
    (lambda: Noise(-1.0), r"std of stage 'noise'"),
    (lambda: Quantisation(0.0), r"step of stage 'quantisation'"),
    (lambda: Quantisation.from_bits(0, full_scale=1.0), r"converter of 0 bits"),
    (lambda: Quantisation.from_bits(8, full_scale=-1.0), r"full_scale is -1.0"),
    (lambda: Clipping(1.0, -1.0), r"below high = -1"),
    (
        lambda: Chain(Noise(1.0), Gain(2.0)),
        r"noise, gain came; .* in the order anti_alias, delay, lag, gain, bias, drift, noise, quantisation, clipping",
    ),
    (lambda: Chain(Gain(1.0), Gain(2.0)), r"each at most once"),
    (lambda: Chain(3.0), r"made of stages \(anti_alias, .*clipping\); 3.0 came"),
    (lambda: Chain(Noise(1.0)).start(RATE), r"stage 'noise' is random: pass rng"),
    (lambda: Chain(Drift(random_walk=1.0)).start(RATE), r"stage 'drift' is random: pass rng"),
    (lambda: Chain().start(-1.0), r"sample rate is -1.0 Hz"),
    (lambda: Chain().apply(np.zeros((3, 2)), RATE), r"block of shape \(3, 2\)"),
    (lambda: Chain(Gain(2.0)).process(Chain().start(RATE), [1.0]), r"belongs to Chain\(\)"),
    (lambda: Chain.from_dict({}), r"a chain needs stages; stages missing"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_bad_input_says_what_is_wrong(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_unknown_names_are_answered_with_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"unknown stage type 'gian'.*Did you mean 'gain'"):
        Stage.from_dict({"type": "gian"})
    with pytest.raises(UnknownNameError, match="unknown entry of a chain 'stage'"):
        Chain.from_dict({"stage": []})


@pytest.fixture
def recording() -> Recording:
    t = np.arange(500) / RATE
    arrays = {"displacement": np.sin(20 * t), "force": 100.0 * np.cos(20 * t), "command": np.ones(500)}
    units = {"displacement": "m", "force": "N", "command": "V"}
    return Recording.from_arrays(
        t, arrays, units=units, roles={"command": "command"}, settle=0.1, meta={"rig": "sdof"}
    )


def test_measure_applies_each_chain_with_a_stream_by_name(recording):
    chains = {"displacement": Chain(Noise(0.01)), "force": Chain(Gain(1.1), Noise(2.0), Quantisation(0.5))}
    measured = measure(recording, chains, generator(3))
    alone = measure(recording, {"force": chains["force"]}, generator(3))
    assert np.array_equal(measured["force"], alone["force"])
    assert np.array_equal(alone["displacement"], recording["displacement"])
    assert np.array_equal(measured["command"], recording["command"])
    assert np.std(measured["displacement"] - recording["displacement"]) == pytest.approx(0.01, rel=0.15)
    assert measured.names == recording.names
    assert measured.settle == recording.settle
    assert measured.channel("force").unit == "N"


def test_measure_says_what_it_did(recording):
    chain = Chain(Gain(-2.0), Noise(3.0))
    once = measure(recording, {"force": chain}, generator(1))
    assert once.channel("force").noise_std == pytest.approx(3.0)
    assert once.channel("force").role == "measured"
    assert once.channel("displacement").noise_std is None
    assert once.channel("displacement").role == ""
    assert once.meta["rig"] == "sdof"
    twice = measure(once, {"force": chain, "command": Chain(Bias(1.0))}, generator(2))
    assert twice.channel("force").noise_std == pytest.approx(np.hypot(2.0 * 3.0, 3.0))
    assert twice.channel("command").noise_std is None
    assert twice.channel("command").role == "command"
    assert [Chain.from_dict(data) for data in twice.meta["measurement"]["force"]] == [chain, chain]


def test_cross_talk_comes_before_the_chain_and_from_the_true_values(recording):
    parts = {"displacement": {"force": 1e-3}, "force": {"displacement": 5.0}}
    measured = measure(recording, {"displacement": Chain(Gain(2.0))}, cross_talk=parts)
    x, f = recording["displacement"], recording["force"]
    np.testing.assert_allclose(measured["displacement"], 2.0 * (x + 1e-3 * f), atol=1e-14)
    np.testing.assert_allclose(measured["force"], f + 5.0 * x, atol=1e-12)


def test_measure_refuses_what_does_not_fit(recording):
    with pytest.raises(UnknownNameError, match=r"unknown channel 'forse'.*Did you mean 'force'"):
        measure(recording, {"forse": Chain()})
    with pytest.raises(UnknownNameError, match="unknown channel 'torque'"):
        measure(recording, {}, cross_talk={"force": {"torque": 1.0}})
    with pytest.raises(ParameterError, match=r"channel 'force': the anti-alias filter"):
        measure(recording, {"force": Chain(AntiAlias(800.0))})
    with pytest.raises(ParameterError, match=r"channel 'force': stage 'noise' is random"):
        measure(recording, {"force": Chain(Noise(1.0))})
    with pytest.raises(ParameterError, match=r"a Chain is expected"):
        measure(recording, {"force": Noise(1.0)}, generator())
    with pytest.raises(ParameterError, match=r"cross-talk of 'force' into 'displacement' is nan"):
        measure(recording, {}, cross_talk={"displacement": {"force": np.nan}})
