"""What a case file need not say: that a record starts in motion, how the loads ran between their samples, the noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted_cases import MASS, NOISE, SAMPLE_RATE, STIFFNESS, load, motion_with, planted_case

from bench.discrepancy import Case, CaseChannel, NominalParameter, diagnose, record_from_arrays
from bench.discrepancy.checks.initial_motion import with_starts_found
from bench.discrepancy.effects.catalogue import CATALOGUE, effect_named
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.judgement.coarse_finding import refusal
from bench.discrepancy.judgement.posterior import closes
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.load_interpolation import reading_notes
from bench.discrepancy.verdict import Gap

FEW = [effect_named(name) for name in ("cubic_stiffness", "gap", "coulomb_friction", "quadratic_damping")]


def cut(case: Case, first: int) -> Case:
    """The same records without their first samples."""

    def late(record):
        return replace(record, values={name: x[first:] for name, x in record.values.items()})

    return replace(
        case,
        identification=tuple(map(late, case.identification)),
        validation=tuple(map(late, case.validation)),
    )


def cubic(x, v, z):
    return 4e6 * x**3, []


def slight(x, v, z):
    return 3e5 * x**3 + 4.0 * v, []


def contact(x, v, z):
    return 3000.0 * np.sign(x) * max(abs(x) - 0.004, 0.0), []


def starts(case: Case) -> list[bool]:
    return [not record.at_rest for record in (*case.identification, *case.validation)]


@pytest.mark.parametrize("effect", [cubic, contact])
@pytest.mark.parametrize("channels", [{"force", "displacement"}, {"force", "displacement", "acceleration"}])
def test_a_record_cut_out_of_a_longer_one_is_seen_to_begin_in_motion(effect, channels):
    case = planted_case(lambda f: motion_with(f, effect))
    case = replace(case, channels=tuple(c for c in case.channels if c.name in channels))
    assert starts(with_starts_found(case)) == [False, False]
    # the phase of the motion at a cut is anybody's guess
    assert all(starts(with_starts_found(cut(case, first))) == [True, True] for first in range(700, 1500, 53))


def test_what_is_stated_about_starts_is_not_doubted():
    case = replace(cut(planted_case(), 900), options={"starts_in_motion": []})
    assert with_starts_found(case) is case


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("a late sensor", lambda x, a, f: (np.concatenate([np.zeros(5), x[:-5]]), a)),
        ("a sensor off its zero", lambda x, a, f: (x + 0.3 * np.std(x), a)),
        ("a drifting one", lambda x, a, f: (x + np.std(x) * np.arange(len(x)) / len(x), a)),
        ("a wrong gain", lambda x, a, f: (1.4 * x, a)),
    ],
)
def test_a_spoilt_record_from_rest_does_not_begin_in_motion(name, changed):
    assert starts(with_starts_found(planted_case(measured=changed))) == [False, False], name


def test_a_force_that_sets_in_with_the_record_is_no_start():
    pushed = planted_case(lambda f: motion_with(f, lambda x, v, z: (5.0, [])))
    assert starts(with_starts_found(pushed)) == [False, False]


def test_an_error_that_dies_away_is_that_of_the_start_where_only_accelerations_are_measured():
    case = planted_case(lambda f: motion_with(f, slight))
    case = replace(case, channels=tuple(c for c in case.channels if c.name != "displacement"))
    late = cut(case, 900)
    assert starts(with_starts_found(late)) == [False, False]  # the nominal model tells nothing of it

    def predict(record):
        x, a = motion_with(record.values["force"], slight)
        return {"displacement": x, "acceleration": a}

    assert starts(with_starts_found(late, predict)) == [True, True]
    assert starts(with_starts_found(case, predict)) == [False, False]


@pytest.mark.slow
def test_an_effect_is_named_in_records_that_begin_in_motion_and_do_not_say_so():
    whole = planted_case(lambda f: motion_with(f, cubic))
    verdict = diagnose(cut(whole, 900), catalogue=FEW, most=1).verdict
    assert [effect.name for effect in verdict.named] == ["cubic_stiffness"]
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor
    assert any("identification, validation" in text for text in verdict.warnings)
    # the same records taken to start at rest: what moved before looks like something else
    stated = replace(cut(whole, 900), options={"starts_in_motion": []})
    assert diagnose(stated, catalogue=FEW, most=1).verdict.gap.after > 3.0 * verdict.gap.noise_floor


def band_limited_case(effects: float, n: int = 4096, rate: float = 100.0) -> Case:
    """A mass on a spring whose force is a band-limited random load, sampled only some twenty times a period.

    The truth is integrated at forty times that rate, with a cubic spring of a relative strength; no code of the diagnosis is used.
    """
    fine = 40
    omega = np.sqrt(STIFFNESS / MASS)
    rng = np.random.default_rng(11)
    records = []
    for name in ("identification", "validation"):
        spectrum = np.zeros(n * fine // 2 + 1, dtype=complex)
        frequency = np.fft.rfftfreq(n * fine, 1.0 / (rate * fine))
        band = (frequency > 1.0) & (frequency < 0.3 * rate)
        spectrum[band] = rng.standard_normal(band.sum()) + 1j * rng.standard_normal(band.sum())
        force = np.fft.irfft(spectrum, n * fine)
        force *= 4.0 / np.std(force) * np.minimum(np.arange(n * fine) / (20.0 * fine), 1.0)
        x, v, h = 0.0, 0.0, 1.0 / (rate * fine)
        position = np.zeros(n * fine)
        for k in range(n * fine - 1):  # velocity Verlet: (omega h)^2 is 3e-5
            a = (force[k] - STIFFNESS * x - effects * STIFFNESS * x**3 / 2e-2**2 - 3.0 * v) / MASS
            half = v + 0.5 * h * a
            x += h * half
            a = (force[k + 1] - STIFFNESS * x - effects * STIFFNESS * x**3 / 2e-2**2 - 3.0 * half) / MASS
            v = half + 0.5 * h * a
            position[k + 1] = x
        assert omega * h < 1e-2
        noise = 5e-3 * np.std(position)
        values = {
            "force": force[::fine],
            "displacement": position[::fine] + noise * rng.standard_normal(n),
        }
        records.append(record_from_arrays(name, np.arange(n) / rate, values))
    parameters = (
        NominalParameter("mass", MASS, 0.01 * MASS), NominalParameter("stiffness", STIFFNESS, 0.02 * STIFFNESS),
        NominalParameter("damping", 3.0, 0.5),
    )  # fmt: skip
    channels = (
        CaseChannel("force", "N", "measured", 0.0),
        CaseChannel("displacement", "m", "response", noise),
    )
    return Case("coarse", "sdof", parameters, channels, (records[0],), (records[1],))


@pytest.mark.slow
@pytest.mark.parametrize(("strength", "named"), [(0.0, []), (0.3, ["cubic_stiffness"])])
def test_a_load_that_was_band_limited_is_read_so_and_no_effect_is_spent_on_it(strength, named):
    case = band_limited_case(strength)
    diagnosis = diagnose(case, most=2)
    assert [effect.name for effect in diagnosis.verdict.named] == named
    assert diagnosis.case.load_interpolation == "band_limited"
    assert any("band-limited" in text for text in diagnosis.verdict.warnings)
    assert diagnosis.verdict.gap.after < 1.3 * diagnosis.verdict.gap.noise_floor
    # what is stated is not doubted
    stated = diagnose(replace(case, options={"load_interpolation": "linear"}), most=1)
    assert stated.case.load_interpolation == "linear"


def test_no_note_where_the_reading_stays():
    case = planted_case()
    assert reading_notes(case, case) == ()
    (note,) = reading_notes(case, replace(case, options={"load_interpolation": "zero_order_hold"}))
    assert "held" in note


def test_a_base_whose_free_run_diverges_is_screened_along_the_measured_motion():
    """A softening spring alone runs away; beside what held it, and behind a sensor effect, it is still a base."""
    case = planted_case(lambda f: motion_with(f, cubic))
    problem = Problem(case, structure_of(case), case.identification)
    found = {(p.effect.name, p.target): p for p in placements(case, problem.structure, CATALOGUE)}
    soft = found["cubic_stiffness", ""]
    gain = next(p for (name, _), p in found.items() if name == "displacement_gain_error")
    vector = np.concatenate([np.zeros(3), [-25.0], [0.1]])
    assert not np.isfinite(problem.residual((soft, gain), vector)).all()
    base = replace(fit(problem, (), start=np.zeros(3), iterations=1), hypothesis=(soft, gain), vector=vector)
    screen = Screen(problem, [found["gap", ""]])
    ground = screen.ground(base)
    assert np.isfinite(ground.residual).all()
    points = screen.ranked(base, ground)
    assert points
    assert np.isfinite(points[0].gain)


def test_friction_is_named_plainly_where_no_noise_is_stated():
    """A flexible friction law leaves a little less of any measured record; without a noise to weigh that by, fewer parameters win."""
    n = 3000
    force = load(4, n)
    rng = np.random.default_rng(0)

    def dry(x, v, z):
        return 2.5 * np.tanh(v / 1e-3), []

    x, _ = motion_with(force, dry)
    x = x + 0.5 * NOISE["displacement"] * rng.standard_normal(n)
    judged = load(5, n)
    y, _ = motion_with(judged, dry)
    parameters = (
        NominalParameter("mass", MASS, 0.01 * MASS), NominalParameter("stiffness", STIFFNESS, 0.02 * STIFFNESS),
        NominalParameter("damping", 3.0, 0.5),
    )  # fmt: skip
    channels = (CaseChannel("force", "N", "measured"), CaseChannel("displacement", "m", "response"))
    clock = np.arange(n) / SAMPLE_RATE
    records = (
        record_from_arrays("identification", clock, {"force": force, "displacement": x}),
        record_from_arrays("validation", clock, {"force": judged, "displacement": y}),
    )
    case = Case("unstated", "sdof", parameters, channels, records[:1], records[1:])
    names = ("time_varying_friction", "stribeck_friction", "power_law_damping", "coulomb_friction")
    verdict = diagnose(case, catalogue=[effect_named(name) for name in names], most=2).verdict
    assert [effect.name for effect in verdict.named] == ["coulomb_friction"]


@pytest.mark.parametrize(("left", "told"), [(0.05, "closes 96.7 %"), (0.35, ""), (np.inf, "")])
def test_unknown_says_how_far_the_nearest_explanation_goes(left, told):
    steps = (("nominal", 0.65), ("parameters only", 0.6), ("gap + cubic_stiffness", left), ("closure", 0.04))
    gap = Gap("a", 0.65, 0.6, 0.04, 0.031, 0.98, (0.9, 1.0), steps)
    words = closes("gap + cubic_stiffness", gap)
    assert told in words
    assert bool(words) == bool(told)


@pytest.mark.parametrize(
    ("harm", "left", "told"),
    [(1.3, 0.4, "leaves more"), (1.0, 1.0, "does not shrink"), (0.8, 0.6, "less than what is named has to")],
)
def test_unknown_says_why_the_judging_records_refuse_the_nearest(harm, left, told):
    known = SimpleNamespace(harm=lambda nearest, nothing: harm, left=lambda nearest, nothing: left)
    assert told in refusal(known, None, None)
