"""Models that are wrong in small ways: how their error is weighed, what is named all the same, and what is not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planted_cases import (
    DAMPING,
    MASS,
    NOISE,
    SAMPLE_RATE,
    STIFFNESS,
    linear_motion,
    motion_with,
    planted_case,
)

from bench.discrepancy import diagnose
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.fits import Search
from bench.discrepancy.fitting.goodness_of_fit import complexity, leaves_much
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.judgement.coarse import Judged, judge
from bench.discrepancy.judgement.doubt import like_small_things, outside, stands_outside
from bench.discrepancy.judgement.finalists import (
    believed,
    bounded,
    finalists,
    no_larger,
    nominal_moves,
    without,
)
from bench.discrepancy.likelihood.model_error import (
    ModelInadequacy,
    band_weights,
    crude_error,
    error_left,
    own_noise,
    smoothed,
)
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.remainder import free_force
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.prediction.discrepancies import Discrepancies
from bench.discrepancy.prediction.held_out import HeldOut, held_out, shares
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.search.extension import Offers, begun_faint, first_fit
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.verdict import NominalEstimate, far_off

FEW = [
    effect_named(name)
    for name in (
        "cubic_stiffness",
        "gap",
        "coulomb_friction",
        "quadratic_damping",
        "stiffness_drift",
        "mass_error",
    )
]
UNSTATED = {"force": None, "displacement": None, "acceleration": None}
UNDERSTATED = {"force": 0.0, **{name: 0.4 * NOISE[name] for name in ("displacement", "acceleration")}}


def resonating(x, v, z):
    """Cubic spring, and besides a hidden part of the mass on a spring of its own, at 12 Hz, damped by 5 %."""
    hidden, omega = 0.005 * MASS, 2.0 * np.pi * 12.0
    pull = hidden * (omega**2 * (x - z[0]) + 0.1 * omega * (v - z[1]))
    return 8e5 * x**3 + pull, [z[1], pull / hidden]


def only_resonating(x, v, z):
    cubic, rates = resonating(x, v, z)
    return cubic - 8e5 * x**3, rates


def humming(x, a, force):
    """A little of what mains do to sensors, slow noise, and a late clock."""
    n = len(x)
    rng = np.random.default_rng(3)
    slow = np.cumsum(rng.standard_normal(n))
    slow -= np.linspace(slow[0], slow[-1], n)
    hum = np.sin(2.0 * np.pi * 50.0 * np.arange(n) / 500.0)
    return (
        x + 0.02 * np.std(x) * (slow / np.std(slow) + hum),
        a + 0.02 * np.std(a) * hum,
    )


def problem_of(case, error=None):
    return Problem(case, structure_of(case), case.identification, error=error)


def test_an_octave_counts_as_so_many_samples_however_finely_it_is_sampled():
    for n in (300, 2048, 2500):
        weights = band_weights(n, 4.0)
        assert weights.max() == 1.0
        for first in (64, 128):
            assert np.sum(weights[first : 2 * first]) == pytest.approx(4.0)
    assert band_weights(2048 + 1024, 4.0)[2048:].sum() == pytest.approx(2.0)  # half an octave


def test_a_spectrum_is_smoothed_over_a_part_of_an_octave_and_keeps_its_level():
    power = np.random.default_rng(1).exponential(3.0, (2000, 1))
    level = smoothed(power)
    assert np.std(level[500:]) < 0.2
    assert np.mean(level) == pytest.approx(3.0, rel=0.05)


def test_the_error_is_never_below_noise_and_makes_the_reference_consistent():
    case = planted_case(lambda f: motion_with(f, resonating, 2), humming)
    plain = problem_of(case)
    nominal = fit(plain, (), start=np.zeros(3))
    assert nominal.reduced > 100.0
    predict = Explanation(((plain, nominal),)).predict
    weighed = problem_of(case, error_left(plain.data, plain.structure, predict))
    # the covariance that residuals are whitened by, the weights taken back
    assert weighed.error is not None
    for before, after in zip(plain.data, weighed.data, strict=True):
        counted = weighed.error.weights(after.n_bins)[:, None]
        assert np.all(own_noise(after) * counted >= own_noise(before) * (1.0 - 1e-9))
    left = weighed.residual((), nominal.vector)
    assert float(left @ left) < 1.3 * weighed.n_residuals
    assert 60.0 < weighed.n_residuals < 120.0
    # what so few samples say moves no parameter by tens of its stated deviations
    assert np.abs(fit(weighed, (), start=np.zeros(3)).vector).max() < np.abs(nominal.vector).max()


def test_what_a_block_would_be_predicted_without_it_is_what_a_fit_without_it_predicts():
    case = planted_case(noise=UNSTATED)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    fitted = fit(problem, (), start=np.zeros(3), tolerance=1e-9)
    found = held_out(Explanation(((problem, fitted),)))
    assert len(found.scores) == 12
    inside = float(np.sum(problem.residual((), fitted.vector) ** 2))
    assert found.total > inside  # a block that was not seen is predicted worse
    assert found.total < 1.5 * inside + 3.0


def test_weights_average_over_what_blocks_say():
    rng = np.random.default_rng(0)
    alike = [HeldOut(Explanation(()), np.ones(12)), HeldOut(Explanation(()), np.ones(12))]
    assert shares(alike, np.zeros(2), rng) == pytest.approx([0.5, 0.5])
    one_block = np.zeros(12)
    one_block[3] = 40.0
    lucky = [HeldOut(Explanation(()), np.zeros(12)), HeldOut(Explanation(()), one_block)]
    steady = [HeldOut(Explanation(()), np.zeros(12)), HeldOut(Explanation(()), np.full(12, 40.0 / 12))]
    # what a single block decides is less certain than what all of them say
    assert shares(lucky, np.zeros(2), rng)[1] > 1e3 * shares(steady, np.zeros(2), rng)[1]


def test_records_in_windows_count_as_many_samples_as_whole_ones():
    error = crude_error(case := planted_case(n=1500), structure_of(case))
    for n in (2000, 8000):
        assert n * error.window_weight(n) == pytest.approx(80.0)
    slide = replace(
        case,
        parameters=tuple(
            replace(p, value=0.0, std=0.0) if p.name == "stiffness" else p for p in case.parameters
        ),
    )
    problem = problem_of(slide, ModelInadequacy({}, scale=4.0))
    assert problem.windowed
    assert problem.n_residuals == pytest.approx(80.0)


def placed(problem, *names):
    effects = [effect_named(name) for name in names]
    targets = ["mass" if e.site == "inertia" else "" for e in effects]
    return tuple(
        Placed(e, problem.structure.places[0], target) for e, target in zip(effects, targets, strict=True)
    )


def explanation(problem, *names, near=None):
    """Fitted from the means of the priors, or from values by name."""
    hypothesis = placed(problem, *names)
    start = np.zeros(3)
    for e in hypothesis:
        values = [p.mean for p in e.effect.parameters]
        if near is not None:
            pairs = zip(e.effect.parameters, near[e.effect.name], strict=True)
            values = [p.eta(value, problem.scales_of(e)) for p, value in pairs]
        start = np.append(start, values)
    return Explanation(((problem, fit(problem, hypothesis, start=start)),))


def test_an_effect_that_makes_the_judging_records_worse_goes():
    def pushed(offset):
        return planted_case(
            lambda f: motion_with(f, lambda x, v, z: (12.0 * v * abs(v) + offset, [])), n=1500
        )

    push = 1e-3 * STIFFNESS  # about a tenth of the motion
    found, judged = pushed(push), pushed(-push)
    case = replace(found, validation=judged.validation)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    explanations = [explanation(problem, *names) for names in (("quadratic_damping", "force_offset"), ())]
    known = Discrepancies(case, problem)
    rest = explanation(problem, "quadratic_damping")
    assert known.harm(explanations[0], rest) > 1.0 > known.harm(rest, explanations[1])
    named = judge(case, problem, explanations, np.random.default_rng(0)).chosen.explanation.hypothesis
    assert [p.effect.name for p in named] == ["quadratic_damping"]


def test_what_few_blocks_leave_open_is_weighed_however_far_its_posterior_is_behind(monkeypatch):
    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (8e5 * x**3, [])), n=600)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    settings = problem.settings.judgement.coarse
    spring, gap, drag, nothing = (
        explanation(problem, *names) for names in (("cubic_stiffness",), ("gap",), ("quadratic_damping",), ())
    )
    told = sorted((gap, drag), key=lambda e: -e.log_posterior)
    assert told[0].log_posterior < spring.log_posterior - settings.reach
    one_block, all_blocks = np.zeros(12), np.full(12, 10.0)
    one_block[3] = 60.0
    scores = {"cubic_stiffness": np.zeros(12), "nothing": np.full(12, 1e4)}

    def predicted(e):
        return HeldOut(e, scores[next((p.effect.name for p in e.hypothesis), "nothing")])

    monkeypatch.setattr("bench.discrepancy.judgement.finalists.held_out", predicted)
    monkeypatch.setattr(
        Discrepancies, "closed", lambda self, e, rest, without: 0.0 if rest.hypothesis else 1.0
    )

    def weighed(nearer, farther):
        for e, score in zip(told, (nearer, farther), strict=True):
            scores[e.hypothesis[0].effect.name] = score
        found = finalists([spring, *told, nothing], Discrepancies(case, problem), settings)
        return [e.explanation.hypothesis[0].effect.name for e in found if e.explanation.hypothesis]

    first, second = (e.hypothesis[0].effect.name for e in told)
    assert weighed(one_block, all_blocks) == ["cubic_stiffness", first]
    assert weighed(one_block, one_block) == ["cubic_stiffness", first, second]
    assert weighed(all_blocks, one_block) == ["cubic_stiffness"]  # none beyond one that is told


def test_what_no_noise_explains_is_not_the_nominal_model_alone(monkeypatch):
    """Blocks prefer a spring that the judging records bear out, by less than what it takes to be described."""
    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (8e5 * x**3, [])), n=600)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    spring, nothing = explanation(problem, "cubic_stiffness"), explanation(problem)
    scores = {spring: np.zeros(12), nothing: np.full(12, 0.6)}
    module = "bench.discrepancy.judgement.finalists"
    monkeypatch.setattr(f"{module}.held_out", lambda e: HeldOut(e, scores[e]))
    monkeypatch.setattr(f"{module}.bounded", lambda e, within: e)
    trusted, doubted = (
        judge(case, problem, [spring, nothing], np.random.default_rng(0), trusted=believed)
        for believed in (True, False)
    )
    assert trusted.weights.tolist() == [1.0, 0.0]
    assert doubted.weights[0] < 0.5
    for told in (trusted, doubted):  # whichever is likelier, what kind of thing it is does not stay open
        assert told.chosen.explanation is spring
        assert told.agreed == pytest.approx(1.0)


def test_what_accounts_for_all_that_another_effect_leaves_is_named_beside_it():
    """A stop at the edge of resonance makes so large a discrepancy that friction closes a small part of it."""

    def stopped(friction, pull):
        def forces(x, v, z):
            gap = 5e3 * (max(x - 0.005, 0.0) + min(x + 0.005, 0.0))
            resonator, rates = only_resonating(x, v, z)
            return gap + friction * math.tanh(v / 1e-3) + pull * resonator, rates

        case = planted_case(lambda f: motion_with(f, forces, hidden=2), n=1500, noise=UNSTATED)
        problem = problem_of(case, crude_error(case, structure_of(case)))
        near = {"gap": (5e3, 0.005), "coulomb_friction": (0.6,)}
        both, gap, nothing = (
            explanation(problem, *names, near=near) for names in (("gap", "coulomb_friction"), ("gap",), ())
        )
        known = Discrepancies(case, problem)
        assert known.closed(both, gap, nothing) < problem.settings.judgement.coarse.material
        named = judge(case, problem, [both, gap, nothing], np.random.default_rng(0)).chosen.explanation
        return known.beside(both, gap), [p.effect.name for p in named.hypothesis]

    (lacking, left), named = stopped(0.6, 0.0)
    assert lacking > 0.05
    assert left < 0.05
    assert named == ["gap", "coulomb_friction"]
    (_, left), named = stopped(0.0, 1.0)  # a small resonator, which friction does not account for
    assert left > 0.2
    assert named == ["gap"]


def test_a_law_whose_further_parts_close_nothing_material_is_named_by_the_plainer_one_that_it_contains():
    """A stop on one side over a faint cubic spring, of which a stop on the other side takes a part; and stops on both sides."""

    def stopped(other_side):
        def forces(x, v, z):
            return 5e3 * max(x - 0.004, 0.0) + other_side * min(x + 0.004, 0.0) + 2e4 * x**3, []

        case = planted_case(lambda f: motion_with(f, forces), n=1500, noise=UNSTATED)
        problem = problem_of(case, crude_error(case, structure_of(case)))
        near = {
            "asymmetric_gap": (5e3, max(other_side, 200.0), 0.004, 0.004),
            "one_sided_stop": (5e3, 0.004, 1.0),
        }
        names = ("asymmetric_gap",), ("one_sided_stop",), ()
        told = judge(
            case, problem, [explanation(problem, *n, near=near) for n in names], np.random.default_rng(0)
        )
        alike = {p.effect.name for entry in told.alike for p in entry.explanation.hypothesis}
        share = told.weights[told.found.index(told.chosen)]
        return [p.effect.name for p in told.chosen.explanation.hypothesis], alike, share

    named, alike, share = stopped(0.0)
    assert named == ["one_sided_stop"]
    assert alike >= {"one_sided_stop", "asymmetric_gap"}
    assert share > 0.4  # the blocks may prefer the richer law, and what that is worth is not known
    assert stopped(2e3)[0] == ["asymmetric_gap"]


@pytest.fixture
def judged(monkeypatch):
    """`left` and `pays` of an explanation, from what it and the nominal model (re-estimated, as stated) leave of the judging records."""
    problem = problem_of(case := planted_case(n=600))
    nothing, found = explanation(problem), explanation(problem, "gap")

    def left_and_pays(re_estimated, stated, after, part):
        of = lambda self, e, *, judging: np.array([re_estimated if e is nothing else after])  # noqa: E731
        monkeypatch.setattr(Discrepancies, "of", of)
        monkeypatch.setattr(Discrepancies, "as_stated", np.array([stated]))
        known = Discrepancies(case, problem)
        return known.left(found, nothing), known.pays(found, nothing, part)

    return left_and_pays


def test_of_a_model_that_is_worse_than_no_motion_only_the_response_is_there_to_be_closed(judged):
    assert judged(3.0, 2.0, 0.65, 0.5) == (pytest.approx(0.65**2, rel=0.01), False)
    assert judged(3.0, 2.0, 0.65, 0.7)[1]


def test_an_effect_has_to_be_nearer_than_the_nominal_model_as_it_was_stated(judged):
    assert judged(0.6, 0.5, 0.1, 0.7)[1]
    assert not judged(0.6, 0.12, 0.1, 0.7)[1]  # parameters re-estimated without the effect had made it worse


@pytest.mark.parametrize(
    ("own", "theirs", "wins"), [(0.0105, 0.01, False), (0.02, 0.011, True), (0.5, 0.495, False)]
)
def test_judging_records_prefer_nothing_for_noise(monkeypatch, own, theirs, wins):
    """What leaves noise alone is as good as anything; beyond it, more than a change that is none."""
    problem = problem_of(case := planted_case(n=600))
    named, rival = explanation(problem, "gap"), explanation(problem, "cubic_stiffness")
    of = lambda self, e, *, judging: np.array([own if e is named else theirs])  # noqa: E731
    monkeypatch.setattr(Discrepancies, "of", of)
    known = Discrepancies(case, problem)
    known._floor = np.array([0.01])
    assert known.prefers(rival, named) == wins
    assert not known.prefers(named, named)


def test_nominal_parameters_stay_within_what_is_believed_whatever_is_taken_from_an_explanation():
    problem = problem_of(planted_case(n=600))
    kept = bounded(explanation(problem, "cubic_stiffness"), 4.0)
    assert kept.parts[0][0].within == 4.0
    alone = without(kept, 0)
    assert np.abs(alone.parts[0][1].vector[: problem.n_physical]).max() <= 4.0


def test_what_an_effect_closes_is_held_against_a_nominal_model_that_is_believed(monkeypatch):
    """A parameter that is moved to where its move is a finding has closed most of that finding itself."""
    case = planted_case(lambda f: linear_motion(f, mass=1.06 * MASS, stiffness=STIFFNESS), n=1500)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    nothing, mass = explanation(problem), explanation(problem, "mass_error")
    settings = problem.settings.judgement.coarse
    assert np.abs(nominal_moves(nothing)).max() > settings.finding
    alone = believed(nothing, mass, settings)
    assert np.abs(nominal_moves(alone)).max() <= settings.finding + 1e-9
    assert believed(alone, mass, settings) is alone
    # an explanation that moves them as far itself gains nothing by that
    assert believed(nothing, nothing, settings) is nothing

    def pays(after, within):
        left = {nothing: 0.016, alone: 0.05, mass: after}
        monkeypatch.setattr(Discrepancies, "of", lambda self, e, *, judging: np.array([left[e]]))
        monkeypatch.setattr(Discrepancies, "as_stated", np.array([0.3]))
        known = Discrepancies(case, problem)
        known._floor = np.array([0.005])
        return known.pays(mass, nothing, 0.5, within)

    assert pays(0.0095, alone)
    assert not pays(0.0095, None)
    assert not pays(0.02, alone)  # what parameters alone leave may not grow, wherever they go


def test_nominal_parameters_that_are_moved_far_are_told():
    near, far = (
        NominalEstimate(name, 1.0 + 0.1 * s, 0.01, 1.0, 0.1, s)
        for name, s in (("mass", 2.0), ("stiffness", -3.5))
    )
    (told,) = far_off((near, far), 3.0)
    assert told.startswith(
        "'stiffness' is re-estimated at 0.65, -3.5 of its stated standard deviations from 1:"
    )


def test_a_family_is_as_likely_as_what_has_an_effect_of_it():
    problem = problem_of(planted_case(n=600))
    rivals = (
        ("cubic_stiffness",),
        ("gap",),
        ("coulomb_friction",),
        ("coulomb_friction", "quadratic_damping"),
        (),
    )
    found = tuple(HeldOut(explanation(problem, *names), np.ones(12)) for names in rivals)
    known = Discrepancies(problem.case, problem)
    weights = np.array([0.2, 0.25, 0.3, 0.15, 0.1])
    for chosen, agreed in ((0, 0.5), (2, 0.5), (3, 0.5), (4, 0.0)):
        told = Judged(
            found[chosen],
            found,
            weights,
            found,
            found,
            False,
            False,
            False,
            {},
            problem.settings.judgement.coarse,
            known,
        )
        assert told.agreed == pytest.approx(agreed)


def test_factors_of_a_response_are_one_kind():
    factors = ("mass_error", "force_gain_error", "acceleration_gain_error", "displacement_gain_error")
    assert {effect_named(name).kind for name in factors} == {"factor"}
    assert effect_named("cubic_stiffness").kind == effect_named("gap").kind == "stiffness"


def test_what_a_free_force_would_still_take_is_told():
    cubic = planted_case(lambda f: motion_with(f, lambda x, v, z: (2e5 * x**3, [])), n=1500)
    for case, kind in ((cubic, "displacement"), (planted_case(n=1500), "")):
        problem = problem_of(case)
        found = free_force(Explanation(((problem, fit(problem, (), start=np.zeros(3))),)))
        if kind:
            assert kind in found["free_force"]
            assert found["free_force_gain"] > 0.5
        else:
            assert found["free_force_gain"] < 0.05


def test_blocks_that_repeat_one_motion_make_no_difference_certain():
    rng = np.random.default_rng(1)
    left = rng.standard_normal(144)
    own = left.reshape(12, 12)
    apart = 0.15 * rng.standard_normal(144)
    # the rival is worse by the same amount in every block
    first = HeldOut(Explanation(()), np.full(12, np.sum(own**2) / 12.0), left)
    rival = HeldOut(Explanation(()), first.scores + 0.4, left + apart)
    worse, error = rival.worse_than(first)
    assert worse == pytest.approx(4.8)
    assert error == pytest.approx(2.0 * np.linalg.norm(apart))


def test_what_is_left_tells_how_likely_the_cause_stands_in_no_catalogue():
    assert outside(0.0) == outside(0.1) == pytest.approx(0.03)
    assert outside(0.3) == pytest.approx(0.1, abs=0.02)
    assert outside(1.0) > 0.95
    parts = [outside(left) for left in np.linspace(0.0, 1.0, 20)]
    assert parts == sorted(parts)


def test_what_is_small_may_be_one_of_the_small_things_of_every_rig():
    sizes = np.linspace(0.05, 1.0, 20)
    likeness = [like_small_things(size) for size in sizes]
    assert likeness == sorted(likeness, reverse=True)
    # what is smaller than the error of a right model is no likelier an effect for that
    assert like_small_things(0.01) == likeness[0]
    # an effect of a fifth of the response is named as surely as before
    assert outside(0.0, besides=like_small_things(0.2)) == outside(0.0)
    assert outside(0.0, besides=likeness[0]) > 5.0 * outside(0.0)
    assert [stands_outside(size) for size in (0.02, 0.1, 0.15, 0.5)] == [False, False, True, True]


def test_two_laws_of_one_number_each_are_held_against_one_of_three():
    problem = problem_of(planted_case(n=600))
    curved = explanation(problem, "stribeck_friction")
    assert no_larger(explanation(problem, "coulomb_friction", "quadratic_damping"), curved)
    assert not no_larger(explanation(problem, "coulomb_friction", "power_law_damping"), curved)


def test_a_law_of_many_parameters_takes_more_to_be_described_than_two_of_one_each():
    place = problem_of(planted_case(n=600)).structure.places[0]

    def size(*names: str) -> float:
        return complexity(tuple(Placed(effect_named(name), place) for name in names))

    assert size("coulomb_friction") < size("stribeck_friction") < size("coulomb_friction", "force_offset")
    assert size("coulomb_friction", "force_offset") < size("backlash_friction")


@pytest.mark.slow
@pytest.mark.parametrize("noise", [NOISE, UNSTATED, UNDERSTATED], ids=["stated", "unstated", "understated"])
def test_an_effect_is_named_over_a_background_that_no_model_has(noise):
    case = planted_case(lambda f: motion_with(f, resonating, 2), humming, noise=noise)
    verdict = diagnose(case, catalogue=FEW).verdict
    assert verdict.verdict == "effect"
    first = verdict.named[0]
    assert first.name == "cubic_stiffness"
    assert not verdict.complete
    assert 0.0 <= verdict.remainder["free_force_gain"] <= 1.0
    assert verdict.gap.after < 0.3 * verdict.gap.parameters_only
    low, high = first.closed_ci95
    assert low <= first.closed <= high
    assert first.closed > 0.5
    k3 = first.parameters["k3"]
    assert abs(k3.value - 8e5) < 3.0 * k3.std
    assert k3.std > 0.01 * k3.value  # the gains of sensors are known to no better
    assert all(abs(p.shift_in_std) < 3.0 for p in verdict.nominal)
    assert any("larger than stated" in note for note in verdict.warnings) == (noise is UNDERSTATED)


def test_a_model_that_is_off_by_more_than_models_are_is_not_called_right_because_nothing_improves_on_it():
    """Nothing that may be named here is a spring, and no noise is stated that the spring could be told from."""
    late = [effect_named("displacement_delay")]
    stiffening = planted_case(lambda f: motion_with(f, resonating, 2), humming, noise=UNSTATED, n=1500)
    verdict = diagnose(stiffening, catalogue=late).verdict
    assert (verdict.verdict, verdict.named) == ("unknown", ())
    assert (
        "small errors of a right model" in verdict.explanation
        or "no catalogued effect is it" in verdict.explanation
    )
    clean = planted_case(noise=UNSTATED, n=1500)
    assert diagnose(clean, catalogue=late).verdict.verdict == "none"


def test_noise_that_is_larger_than_stated_is_said_and_nothing_is_missing_for_it():
    stated = {"force": 0.0, **{name: 0.75 * NOISE[name] for name in ("displacement", "acceleration")}}
    verdict = diagnose(planted_case(noise=stated), catalogue=FEW).verdict
    assert (verdict.verdict, verdict.named) == ("none", ())
    said = [note for note in verdict.warnings if "larger than stated" in note]
    assert [note.split("'")[1] for note in said] == ["displacement", "acceleration"]
    assert "larger than stated" in verdict.explanation


def test_a_spring_far_outside_what_was_stated_is_named_beside_a_small_law_and_closes_what_it_closes():
    """The spring's own parameter could go as far; what it is held against has the parameter where that is believed to be."""
    softer = planted_case(
        lambda f: motion_with(f, lambda x, v, z: (-0.2 * STIFFNESS * x + 9.0 * v * abs(v), []))
    )
    verdict = diagnose(softer, catalogue=[*FEW, effect_named("stiffness_error")]).verdict
    assert [effect.name for effect in verdict.named] == ["stiffness_error", "quadratic_damping"]
    assert all(effect.probability > 0.95 for effect in verdict.named)
    assert verdict.named[0].closed > verdict.named[1].closed > 0.1
    assert not verdict.indistinguishable
    assert verdict.complete
    assert all(abs(entry.shift_in_std) < 3.0 for entry in verdict.nominal)


def jittering(force):
    """Readings of a linear rig at instants that are off by a fifth of a sample (standard deviation)."""
    clock = np.arange(len(force)) / SAMPLE_RATE
    taken = clock + 0.2 / SAMPLE_RATE * np.random.default_rng(11).standard_normal(len(force))
    return tuple(np.interp(taken, clock, own) for own in linear_motion(force))


def test_what_grows_with_the_motion_and_is_no_force_is_no_effect_although_noise_is_stated():
    """A clock that jitters leaves more where the motion is faster: no white noise, and less than sensors are calibrated to."""
    verdict = diagnose(planted_case(jittering), catalogue=FEW).verdict
    assert (verdict.verdict, verdict.named) == ("none", ())
    assert "neither an effect of the catalogue nor a free force predicts" in verdict.explanation
    assert not verdict.complete
    # as small a part of a motion that a force makes is one that a free force takes
    quiet = {"force": 0.0, **{name: 0.1 * NOISE[name] for name in ("displacement", "acceleration")}}
    softening = planted_case(lambda f: motion_with(f, lambda x, v, z: (-6e3 * x**3, [])), noise=quiet)
    found = diagnose(softening, catalogue=[effect_named("displacement_delay")]).verdict
    assert found.gap.parameters_only < 0.02
    assert found.verdict == "unknown"


def test_a_law_that_is_bent_to_what_no_catalogue_holds_is_not_named():
    """Spheres that touch, and a catalogue of cubic springs."""
    few = [effect_named("cubic_stiffness"), effect_named("quadratic_stiffness")]

    def verdict(force):
        case = planted_case(lambda f: motion_with(f, lambda x, v, z: (force(x), [])), n=1500, noise=UNSTATED)
        return diagnose(case, catalogue=few).verdict

    touching = verdict(lambda x: 1e4 * max(x, 0.0) ** 1.5)
    assert (touching.verdict, touching.closure) == ("unknown", "free_displacement")
    assert "a single smooth force of the displacement" in touching.explanation
    assert [e.name for e in touching.nearest] == ["cubic_stiffness"]
    assert [e.name for e in verdict(lambda x: 4e5 * x**3).named] == ["cubic_stiffness"]


def test_a_further_effect_that_made_it_worse_is_begun_again_faint():
    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (4e5 * x**3, [])), n=1500, noise=UNSTATED)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    search, base = Search(problem), explanation(problem, "cubic_stiffness").parts[0][1]
    stopped = (*base.hypothesis, *placed(problem, "gap"))
    eta = np.array([1.0, -1.5])  # stiff and tight: another motion
    task = (stopped, np.append(base.vector, eta))
    worse = first_fit(problem, *task)
    search.add(worse)
    (again,) = begun_faint(search, Offers(base, [task], []))
    assert np.all(again[1][:, -2] < eta[0])
    found = first_fit(problem, *again)
    assert found.cost < min(worse.cost, 1.01 * base.cost)
    # what is better than its base already is left alone, and so is everything where noise decides
    search.add(replace(found, cost=0.5 * base.cost))
    assert not list(begun_faint(search, Offers(base, [task], [])))
    assert not list(begun_faint(Search(problem_of(case)), Offers(base, [task], [])))


def test_a_hypothesis_weighed_by_what_itself_leaves_may_leave_much():
    case = planted_case(lambda f: motion_with(f, lambda x, v, z: (4e5 * x**3, [])), n=1500, noise=UNSTATED)
    problem = problem_of(case, crude_error(case, structure_of(case)))
    nothing, right = (explanation(problem, *names).parts[0][1] for names in ((), ("cubic_stiffness",)))
    assert leaves_much(problem, nothing)
    assert not leaves_much(problem, right)


def test_what_there_is_no_time_for_is_left_out_and_said():
    case = planted_case(lambda f: motion_with(f, resonating, 2), humming, noise=NOISE, n=1500)
    hurried = replace(DEFAULT, budget=1e-6)
    for verdict in (
        diagnose(case, catalogue=FEW, budget=1e-6).verdict,
        diagnose(case, catalogue=FEW, settings=hurried).verdict,
    ):
        assert verdict.verdict in {"effect", "unknown"}
        note = next(text for text in verdict.warnings if "no time for" in text)
        assert "2 effects together" in note
        # rivals that were never tried may be the cause
        assert all(e.probability <= 0.5 for e in (*verdict.named, *verdict.ranking))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [NOISE, UNSTATED], ids=["stated", "unstated"])
def test_a_background_alone_is_not_named_with_certainty(noise):
    case = planted_case(lambda f: motion_with(f, only_resonating, 2), humming, noise=noise)
    verdict = diagnose(case, catalogue=FEW).verdict
    assert not [e for e in verdict.named if e.probability >= 0.9]


@pytest.mark.slow
def test_a_mass_beyond_its_uncertainty_is_named_and_not_moved_in_silence():
    def heavy(force):
        return linear_motion(force, mass=1.3 * MASS, stiffness=STIFFNESS)

    case = planted_case(heavy, humming, noise=UNSTATED)
    verdict = diagnose(case, catalogue=FEW).verdict
    assert [e.name for e in verdict.named] == ["mass_error"]
    assert verdict.named[0].parameters["relative_error"].value == pytest.approx(0.29, abs=0.03)
    assert all(abs(p.shift_in_std) < 3.0 for p in verdict.nominal)


@pytest.mark.slow
def test_a_damper_that_is_off_is_a_number_and_no_relaxation():
    """A quick relaxation is a damper over the whole band: the plainer one is named, and the other said to do as well."""

    def damped(force):
        return linear_motion(force, damping=4.0 * DAMPING)

    names = ("damping_error", "viscoelastic_relaxation", "quadratic_damping", "coulomb_friction")
    verdict = diagnose(
        planted_case(damped, noise=UNSTATED), catalogue=[effect_named(name) for name in names]
    ).verdict
    assert [e.name for e in verdict.named] == ["damping_error"]
    damping = next(p for p in verdict.nominal if p.name == "damping")
    assert damping.value == pytest.approx(4.0 * DAMPING, rel=0.03)
    assert verdict.indistinguishable == (("damping_error", "viscoelastic_relaxation"),)


@pytest.mark.slow
def test_noise_that_nobody_stated_is_no_effect():
    case = planted_case(noise=UNSTATED)
    verdict = diagnose(case, catalogue=FEW).verdict
    assert verdict.verdict == "none"
    quiet = replace(case, validation=case.identification)
    assert diagnose(quiet, catalogue=FEW).verdict.verdict == "none"
