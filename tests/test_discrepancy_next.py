"""The next test: feasible, powerful as predicted, and a reason in words."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bench.cli import main
from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.model_error import crude_error
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.next_test import discriminating_excitation
from bench.discrepancy.next_test.belief import Belief
from bench.discrepancy.next_test.discriminating_excitation import propose, separate, told_apart
from bench.discrepancy.next_test.distinguishability import sensitivity, why_none
from bench.discrepancy.next_test.feasible_excitations import limits_of, shapes
from bench.discrepancy.next_test.outlook import outlook
from bench.discrepancy.report.model_update import element_code, element_toml
from bench.discrepancy.search.explanation import Explanation

RATE, N = 500.0, 3000
NOISE = 0.02


def small_motion(seed: int = 1) -> tuple[Problem, Explanation, Explanation]:
    """A record whose motion hardly left a gap, explained by a gap and by a cubic stiffness."""
    rng = np.random.default_rng(seed)
    time = np.arange(N) / RATE
    spectrum = np.fft.rfft(rng.standard_normal(N))
    spectrum[np.fft.rfftfreq(N, 1 / RATE) > 8.0] = 0.0
    load = np.fft.irfft(spectrum, N)
    load *= 2.0 / np.std(load)
    nominal = tuple(
        NominalParameter(name, value, 0.02 * value, unit)
        for name, value, unit in (
            ("mass", 2.0, "kg"),
            ("damping", 5.0, "N s/m"),
            ("stiffness", 1500.0, "N/m"),
        )
    )
    blank = record_from_arrays("identification", time, {"force": load, "displacement": np.zeros(N)})
    channels = (
        CaseChannel("force", "N", "measured", 0.0),
        CaseChannel("displacement", "m", "response", 1e-4),
    )
    bare = Case("bare", "sdof", nominal, channels, (blank,), (blank,))
    place = structure_of(bare).places[0]
    gap, cubic = (Placed(effect_named(name), place) for name in ("gap", "cubic_stiffness"))
    linear = Problem(bare, structure_of(bare), (blank,)).simulate((), np.zeros(3), blank)[:, 0]
    level = NOISE * float(np.std(linear))
    filled = record_from_arrays("identification", time, {"force": load, "displacement": linear})
    case = Case(
        "bare",
        "sdof",
        nominal,
        (channels[0], CaseChannel("displacement", "m", "response", level)),
        (filled,),
        (filled,),
    )
    scaler = Problem(case, structure_of(case), (filled,))
    truth = np.array([0.0, 0.0, 0.0, np.log(0.4), np.log(0.8)])
    truth[3] = gap.effect.parameters[0].eta(400.0, scaler.scales_of(gap))
    clean = scaler.simulate((gap,), truth, filled)[:, 0]
    noisy = record_from_arrays(
        "identification", time, {"force": load, "displacement": clean + level * rng.standard_normal(N)}
    )
    final = Case("small", "sdof", nominal, case.channels, (noisy,), (noisy,))
    problem = Problem(final, structure_of(final), (noisy,))
    first = fit(problem, (gap,), start=truth)
    second = fit(problem, (cubic,), start=np.array([0.0, 0.0, 0.0, 0.1]))
    return problem, Explanation(((problem, first),)), Explanation(((problem, second),))


def test_the_proposal_keeps_the_limits_of_the_rig_and_beats_repeating_the_record():
    problem, gap, cubic = small_motion()
    found = propose(problem, gap, cubic)
    assert found is not None
    proposal, look = found
    limits = limits_of(problem)
    for name, peak in proposal.peaks.items():
        assert peak <= limits.load[name] * (1 + 1e-9)
    for name, reached in proposal.motion.items():
        assert reached <= limits.motion[name] * (1 + 1e-9)
    again = outlook(problem, Belief.of(gap), Belief.of(cubic), problem.records[0])
    assert again is not None
    assert look.log_odds > again.log_odds
    assert 0.0 <= look.power <= 1.0


def test_stated_limits_count_for_more_than_those_of_the_records():
    problem, gap, cubic = small_motion()
    problem.case.options["limits"] = {"force": 0.5}  # type: ignore[index]
    found = propose(problem, gap, cubic)
    assert found is not None
    assert found[0].peaks["force"] <= 0.5 * (1 + 1e-9)


def test_the_reason_names_what_the_motion_reached():
    problem, gap, cubic = small_motion()
    first, second = sorted((gap, cubic), key=lambda e: -e.log_posterior)
    told = separate(problem, (first, second))
    if told:  # with odds beyond ten thousand to one there is nothing left to separate
        assert set(told["separates"]) == {"gap", "cubic_stiffness"}
        assert "displacement" in told["reason"]
    assert "largest displacement" in why_none(
        problem, [Placed(effect_named("gap"), problem.structure.places[0])]
    )
    assert told_apart(problem, "unknown", (effect_named("gap"),)) == {}


def test_what_would_have_shown_is_told_against_the_error_of_the_model_where_that_is_larger_than_noise():
    problem, _, _ = small_motion()
    error = crude_error(problem.case, problem.structure, problem.settings.likelihood.error)
    rough = Problem(
        problem.case, problem.structure, problem.case.identification, error=error, settings=problem.settings
    )
    cubic = [Placed(effect_named("cubic_stiffness"), problem.structure.places[0])]
    (sharp,), (told,) = sensitivity(problem, cubic).values(), sensitivity(rough, cubic).values()
    assert told > sharp


@pytest.mark.slow
def test_the_predicted_power_is_the_rate_at_which_the_true_rival_wins():
    """Proposed test simulated under each rival, its parameters drawn from the posterior, and both fitted again."""
    problem, gap, cubic = small_motion()
    found = propose(problem, gap, cubic)
    assert found is not None
    proposal, look = found
    rng = np.random.default_rng(5)
    rivals = (Belief.of(gap), Belief.of(cubic))
    level = problem.noise[0]
    wins = 0
    draws = 12
    for k in range(draws):
        true = rivals[k % 2]
        vector = true.within(true.vector + true.root @ rng.standard_normal(len(true.vector)))
        response = true.respond(problem, proposal.record, vector)[:, 0]
        values = {
            **proposal.record.values,
            "displacement": response + level * rng.standard_normal(len(response)),
        }
        record = record_from_arrays("identification_2", proposal.record.time, values)
        both = Problem(problem.case, structure_of(problem.case), (*problem.records, record))
        evidence = [
            fit(both, r.explanation.hypothesis, start=r.vector, iterations=12).log_evidence for r in rivals
        ]
        odds = (evidence[0] - evidence[1]) * (1 if k % 2 == 0 else -1)
        wins += odds > np.log(99.0)
    # two standard deviations of a binomial of twelve draws, and a tenth for the linearisation
    tolerance = 2.0 * np.sqrt(max(look.power * (1 - look.power), 0.05) / draws) + 0.1
    assert wins / draws == pytest.approx(look.power, abs=tolerance)


def test_a_found_effect_is_valid_code_and_configuration():
    import tomllib

    from bench.rig import Element
    from bench.rig.configuration import element_from_configuration

    theta = (1200.0, 0.004, 0.0, 0.0)
    entry = tomllib.loads(element_toml("gap", theta, ("carriage",)))["elements"][0]
    element = element_from_configuration(entry)
    np.testing.assert_allclose(element.theta, theta)
    scope: dict = {}
    exec(element_code("gap", theta, ("carriage",)).replace("rig = rig.with_element(element)", ""), scope)
    assert isinstance(scope["element"], Element)
    np.testing.assert_allclose(scope["element"].theta, theta)


@pytest.mark.parametrize("periods", [2.0, 2.7, 4.0, 30.0])
def test_every_shape_fits_into_a_record_of_a_few_periods(periods):
    """What lasts too long for the record of a user would end the diagnosis and lose its verdict."""
    rate, samples = 500.0, 300
    for label, signal in shapes(periods * rate / samples, samples / rate):
        x = signal.sample(samples, rate, np.random.default_rng(1))
        assert np.isfinite(x).all(), label
        assert np.ptp(x) > 0.0, label


def test_a_planner_takes_the_question_that_the_records_leave_open(tmp_path, capsys, monkeypatch):
    problem, gap, cubic = small_motion()
    monkeypatch.setattr(discriminating_excitation, "log_odds", lambda first, second: 1.0)
    asked = separate(problem, [gap, cubic])["closed_loop"]
    assert asked["elements"][0]["law"] == "gap"
    assert asked["experiment"]["rival"]["elements"][0]["law"] == "cubic_stiffness"
    assert asked["structure"]["mass"]["carriage"] == pytest.approx(2.0, rel=0.05)
    # the records last 6 s, in which the planner decides some twenty times
    asked["experiment"]["duration"] = 2.0
    verdict = tmp_path / "verdict.json"
    verdict.write_text(json.dumps({"verdict": "effect", "next_excitation": {"closed_loop": asked}}))
    out = tmp_path / "next.csv"
    assert main(["excite", str(verdict), "--method", "planner", "-o", str(out), "--json"]) == 0
    notes = json.loads(capsys.readouterr().out)["notes"]
    assert any("log Bayes factor" in note for note in notes)
    force = np.loadtxt(out, delimiter=",", skiprows=1)[:, 1]
    assert 0.0 < np.max(np.abs(force)) <= asked["experiment"]["force"]["shaker"] * (1.0 + 1e-6)


def test_a_verdict_without_such_a_question_says_so(tmp_path, capsys):
    verdict = tmp_path / "verdict.json"
    verdict.write_text(json.dumps({"verdict": "none", "next_excitation": {}}))
    assert main(["excite", str(verdict), "--method", "planner", "-o", str(tmp_path / "next.csv")]) != 0
    assert "no test which a planner could shape" in capsys.readouterr().err
