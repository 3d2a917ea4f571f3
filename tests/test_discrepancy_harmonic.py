"""A harmonic force from outside: its line, its fit, and a rotor whose speed differs between the records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import NOISE, SAMPLE_RATE, linear_motion, load, planted_case

from bench.discrepancy import Case, diagnose, record_from_arrays
from bench.discrepancy.fitting.fits import Search
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.unscreened.harmonic_force import with_harmonic_force
from bench.discrepancy.unscreened.sensor_hum import with_hum
from bench.discrepancy.unscreened.spectral_lines import lines_of
from bench.laws import find_law

N = 4000
TIME = np.arange(N) / SAMPLE_RATE


def harmonic(force: float, frequency: float, phase: float) -> np.ndarray:
    return force * np.cos(2.0 * np.pi * frequency * TIME + phase)


def case_with(*forces: np.ndarray) -> Case:
    """A planted case on whose records forces act that no channel tells, one a record; the last one is for judging."""
    case, rng = planted_case(n=N), np.random.default_rng(5)
    records = []
    for seed, extra in enumerate(forces):
        known = load(seed, N)
        x, a = linear_motion(known + extra)
        values = {
            "force": known,
            "displacement": x + NOISE["displacement"] * rng.standard_normal(N),
            "acceleration": a + NOISE["acceleration"] * rng.standard_normal(N),
        }
        records.append(record_from_arrays(f"record_{seed}", TIME, values))
    return replace(case, identification=tuple(records[:-1]), validation=(records[-1],))


def test_the_kernel_pushes_towards_positive_displacement_at_its_phase():
    law = find_law("harmonic_force")
    for time, expected in ((0.0, -3.0 * np.cos(0.4)), (0.1, -3.0 * np.cos(0.2 * np.pi * 2.5 + 0.4))):
        f = np.zeros(1)
        law.force(time, np.zeros(1), np.zeros(1), np.zeros(1), law.theta([3.0, 2.5, 0.4]), f)
        assert f[0] == pytest.approx(expected)


def test_a_line_is_found_to_a_part_of_the_resolution_and_noise_has_none():
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(N)
    coloured = np.convolve(rng.standard_normal(N), np.exp(-np.arange(60) / 12.0), mode="same")
    for background in (noise, coloured, load(3, N)):
        assert lines_of(TIME, background) == []
        (found,) = lines_of(TIME, background + harmonic(2.0 * np.std(background), 16.713, 0.7))
        # a frequency is known to the resolution over the ratio of the line's power to that of a bin of noise, here hundreds
        assert abs(found.frequency - 16.713) < 0.03 * SAMPLE_RATE / N
        assert found.amplitude == pytest.approx(2.0 * np.std(background), rel=0.06)
        assert found.phase == pytest.approx(0.7, abs=0.15)


def test_lines_at_multiples_of_a_harmonic_load_are_left_to_the_load():
    square = np.sign(harmonic(1.0, 3.04, 0.2)) + 1e-3 * np.random.default_rng(1).standard_normal(N)
    own = harmonic(0.05, 20.3, 0.0)
    assert lines_of(TIME, square)[0].frequency == pytest.approx(3.04, abs=0.01)
    found = lines_of(TIME, square + own, [harmonic(1.0, 3.04, 1.1)])[0]
    # the sampled square wave has lines at multiples that are folded back, too; the largest that is no multiple is the one added
    assert found.frequency == pytest.approx(20.3, abs=0.03)


def test_ripples_in_the_spectrum_of_a_swept_sine_are_no_lines_of_a_load():
    swept = np.sin(2.0 * np.pi * (2.0 + 1.5 * TIME) * TIME)
    friction = np.sign(np.cos(2.0 * np.pi * (2.0 + 1.5 * TIME) * TIME))
    found = lines_of(TIME, friction + harmonic(1.0, 29.3, 0.0), [swept])[0]
    assert found.frequency == pytest.approx(29.3, abs=0.03)


@pytest.mark.slow
def test_a_hum_that_no_channel_tells_is_named_with_its_frequency_and_force():
    diagnosis = diagnose(case_with(harmonic(3.0, 9.27, 0.8), harmonic(3.0, 9.27, -2.1)))
    verdict = diagnosis.verdict
    assert [effect.name for effect in verdict.named] == ["harmonic_force"]
    found = verdict.named[0].parameters
    assert abs(found["force"].value - 3.0) < 5 * found["force"].std
    assert abs(found["frequency"].value - 9.27) < 5 * found["frequency"].std + 1e-4
    assert found["phase_record_0"].value == pytest.approx(0.8, abs=0.05)
    # the phase of the judging record is its own; its force is that of the other one
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor < 0.3 * verdict.gap.before


def humming(case: Case, channel: str, amplitude: float, frequency: float) -> Case:
    """A planted case of which one channel picks up a line, of another phase in every record."""
    rng = np.random.default_rng(9)

    def hum(record):
        values = dict(record.values)
        values[channel] = values[channel] + harmonic(amplitude, frequency, 6.28 * rng.random())
        return record_from_arrays(record.name, TIME, values)

    records = [tuple(map(hum, part)) for part in (case.identification, case.validation)]
    return replace(case, identification=records[0], validation=records[1])


@pytest.mark.slow
@pytest.mark.parametrize(("channel", "noises"), [("displacement", 40.0), ("acceleration", 20.0)])
def test_mains_hum_in_one_of_two_channels_is_the_sensor_s_and_no_force(channel, noises):
    case = humming(case_with(np.zeros(N), np.zeros(N)), channel, noises * NOISE[channel], 50.02)
    verdict = diagnose(case).verdict
    assert [effect.name for effect in verdict.named] == [f"{channel}_hum"]
    found = verdict.named[0].parameters
    assert abs(found["amplitude"].value - noises * NOISE[channel]) < 5 * found["amplitude"].std
    assert found["frequency"].value == pytest.approx(50.02, abs=1e-3)
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor


def test_where_a_force_explains_a_line_a_sensor_is_asked_as_well():
    """Of a line that an accelerometer alone has, a force of its frequency leaves no more than noise of the displacement either."""
    case = humming(case_with(np.zeros(N), np.zeros(N)), "acceleration", 6.0 * NOISE["acceleration"], 50.02)
    problem = Problem(case, structure_of(case, settings=DEFAULT), case.identification, settings=DEFAULT)
    search = Search(problem)
    search.add(fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=20))
    with_harmonic_force(search)
    assert [placed.effect.name for placed in search.ranked()[0].hypothesis] == ["harmonic_force"]
    assert consistent(search.ranked()[0])
    with_hum(search, {"acceleration_hum", "displacement_hum"})
    assert [placed.effect.name for placed in search.ranked()[0].hypothesis] == ["acceleration_hum"]


def unstated(case: Case) -> Case:
    """A case of which nobody knows the noise."""
    return replace(case, channels=tuple(replace(channel, noise_std=None) for channel in case.channels))


@pytest.mark.slow
@pytest.mark.parametrize("noises", [0.0, 20.0])
def test_mains_hum_of_a_sensor_that_is_not_judged_is_named_where_no_noise_is_stated(noises):
    """Weighed by what is left of it, a line is noise like another; no other channel tells of it, and the displacement is explained."""
    case = humming(case_with(np.zeros(N), np.zeros(N)), "acceleration", noises * NOISE["acceleration"], 50.02)
    verdict = diagnose(unstated(case)).verdict
    assert [effect.name for effect in verdict.named] == (["acceleration_hum"] if noises else [])
    assert verdict.verdict == ("effect" if noises else "none")


@pytest.mark.slow
def test_a_force_at_the_frequency_of_the_mains_is_one_where_two_channels_tell():
    verdict = diagnose(case_with(harmonic(30.0, 50.0, 0.8), harmonic(30.0, 50.0, -2.1))).verdict
    assert [effect.name for effect in verdict.named] == ["harmonic_force"]


@pytest.mark.slow
def test_the_force_of_a_rotor_at_other_speeds_grows_with_their_square():
    unbalance = 3.0 / 9.27**2
    speeds = (9.27, 7.4, 8.31)
    forces = [harmonic(unbalance * f**2, f, phase) for f, phase in zip(speeds, (0.8, -2.1, 0.3), strict=True)]
    verdict = diagnose(case_with(*forces)).verdict
    assert [effect.name for effect in verdict.named] == ["harmonic_force"]
    found = verdict.named[0].parameters
    assert abs(found["force"].value - 3.0) < 5 * found["force"].std
    assert found["frequency_record_1"].value == pytest.approx(7.4, abs=1e-3)
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor < 0.3 * verdict.gap.before
