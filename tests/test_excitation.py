"""Excitations of several actuators: columns, independence of the channels, round trips, bad input."""

from __future__ import annotations

import json
import pickle
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.errors import ParameterError, UnknownNameError
from bench.signals import BandLimitedNoise, Constant, Excitation, Harmonic, Multisine, Tapered, named_streams


def generator(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_excitation_samples_a_column_for_each_name():
    drive = Excitation({"axial": Harmonic(2.0), "torsion": Constant(3.0)}, duration=2.0, sample_rate=100.0)
    u = drive.sample()
    assert drive.names == ("axial", "torsion")
    assert u.shape == (200, 2) == (drive.n_samples, 2)
    assert drive.time[-1] == pytest.approx(1.99)
    np.testing.assert_allclose(u[:, 0], np.sin(4 * np.pi * drive.time), atol=1e-14)
    assert np.all(u[:, 1] == 3.0)


@settings(max_examples=20, deadline=None)
@given(
    names=st.lists(st.text(min_size=1, max_size=8), min_size=2, max_size=5, unique=True),
    seed=st.integers(0, 2**32),
    order=st.randoms(use_true_random=False),
)
def test_one_more_channel_or_another_order_changes_nothing_for_the_others(names, seed, order):
    signals = {name: BandLimitedNoise(12.0) for name in names}
    shuffled = list(names)
    order.shuffle(shuffled)
    whole = Excitation(signals, 1.0, 100.0).sample(generator(seed))
    alone = Excitation({names[0]: BandLimitedNoise(12.0)}, 1.0, 100.0).sample(generator(seed))
    mixed = Excitation({name: signals[name] for name in shuffled}, 1.0, 100.0).sample(generator(seed))
    assert np.array_equal(whole[:, 0], alone[:, 0])
    assert np.array_equal(whole[:, 0], mixed[:, shuffled.index(names[0])])
    assert not np.array_equal(whole[:, 0], whole[:, 1])


def test_excitation_round_trip_and_immutability():
    drive = Excitation({"b": Harmonic(2.0) + BandLimitedNoise(12.0), "a": Constant(1.0)}, 2.0, 500.0)
    again = Excitation.from_dict(json.loads(json.dumps(drive.to_dict(), allow_nan=False)))
    assert again == drive
    assert hash(again) == hash(drive)
    assert again.names == drive.names
    assert np.array_equal(pickle.loads(pickle.dumps(drive)).sample(generator()), drive.sample(generator()))
    with pytest.raises(TypeError):
        drive.signals["axial"] = Constant()


def test_excitation_is_read_from_toml():
    plan = tomllib.loads("""
        duration = 30
        sample_rate = 1000
        [signals.axial]
        type = "tapered"
        fade_in = 0.5
        signal = { type = "band_limited_noise", cutoff = 12, peak = 1000 }
        [signals.torsion]
        type = "multisine"
        band = [1, 12]
        phases = "schroeder"
        spectrum = [[1, 1.0], [12, 0.5]]
    """)
    assert Excitation.from_dict(plan) == Excitation(
        {
            "axial": Tapered(BandLimitedNoise(12.0, peak=1000.0), fade_in=0.5),
            "torsion": Multisine((1.0, 12.0), phases="schroeder", spectrum=((1.0, 1.0), (12.0, 0.5))),
        },
        30.0,
        1000.0,
    )


def test_named_streams_advance_the_parent_alike():
    one, two = generator(1), generator(1)
    named_streams(one, ["a"])
    named_streams(two, ["a", "b", "c"])
    assert one.random() == two.random()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Excitation({}, 1.0, 10.0), r"needs signals by name"),
        (lambda: Excitation({"a": 3.0}, 1.0, 10.0), r"maps names to signals; 'a': 3.0"),
        (lambda: Excitation({"a": Constant()}, -1.0, 10.0), r"duration of the excitation is -1.0"),
        (lambda: Excitation({"a": Constant()}, 0.001, 10.0), r"less than one sample"),
        (
            lambda: Excitation.from_dict({"duration": 1.0}),
            r"needs duration, sample_rate, signals; sample_rate, signals missing",
        ),
        (lambda: named_streams(3, ["a"]), r"numpy.random.Generator"),
    ],
)
def test_bad_excitations_say_what_is_wrong(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_an_excitation_names_the_channel_that_fails():
    drive = Excitation({"good": Constant(), "fast": Harmonic(80.0)}, 1.0, 100.0)
    with pytest.raises(ParameterError, match=r"excitation of 'fast': signal 'harmonic' reaches 80 Hz"):
        drive.sample()


def test_unknown_entries_are_answered_with_the_known_ones():
    with pytest.raises(
        UnknownNameError, match=r"unknown entry of an excitation 'durations'.*Did you mean 'duration'"
    ):
        Excitation.from_dict({"durations": 1.0, "sample_rate": 100.0, "signals": {}})
