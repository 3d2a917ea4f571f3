"""Laws that follow a channel, and friction that differs from record to record where no channel tells."""

from __future__ import annotations

import numpy as np
import pytest

from bench.discrepancy import Case, CaseChannel, NominalParameter, diagnose, record_from_arrays
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.friction_limits import coulomb_limit
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.search.varied_size import differs_in_vain
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.stick_slip import Elements, StructureMatrices, free_run
from bench.discrepancy.unscreened.scheduled import differing

RATE = 500.0


def schedule(samples: np.ndarray, start: float = 0.0) -> np.ndarray:
    return np.concatenate([[start, RATE, len(samples)], samples])


def scaled_friction(samples: np.ndarray, limit: float, start: float = 0.0) -> Elements:
    table = np.array([[0, 0, coulomb_limit.address, 1, 0, 0, 0, 0, 2]], dtype=np.int64)
    return Elements(table, np.ones((1, 1)), np.append([limit], schedule(samples, start)), np.zeros(0))


def test_a_schedule_scales_the_limit_of_friction_that_slides_and_sticks():
    n = 600
    t = np.arange(n) / RATE
    factor = 1.0 + 0.5 * np.sin(3.0 * t)
    velocity = np.cos(20.0 * t)[:, None]
    force = driven_force(
        scaled_friction(factor, 4.0, 7.0), position=velocity, velocity=velocity, step=1 / RATE, start_time=7.0
    )
    np.testing.assert_allclose(force[:, 0], 4.0 * factor * np.sign(velocity[:, 0]), atol=1e-12)
    block = StructureMatrices(*(np.array([[x]]) for x in (2.0, 0.0, 0.0, 1.0)))
    falling = 1.0 - t
    motion = free_run(block, scaled_friction(falling, 4.0), loads=np.full((n, 1), 2.0), step=1 / RATE)
    loose = t > 0.5 + 2.0 / RATE  # the limit falls below the load at half a second
    assert np.all(motion.velocity[t <= 0.5, 0] == 0.0)
    assert np.all(motion.velocity[loose, 0] > 0.0)


def component(limits, tension: bool) -> Case:
    """Records of a component whose friction follows a tension, told by a channel or not."""
    rng = np.random.default_rng(3)
    records = []
    t = np.arange(2500) / RATE
    for i, limit in enumerate(limits):
        q = 5.0 * np.sin(2 * np.pi * (0.5 + 0.1 * i) * t + 0.3)
        s = limit * (1.0 + 0.3 * np.sin(2 * np.pi * 0.37 * t) * tension)
        force = 0.4 * s * np.sign(np.gradient(q, t)) + 1.5 * q + rng.normal(0.0, 0.3, len(t))
        name = f"identification_{i}" if i < len(limits) - 1 else "validation"
        values = {"displacement": q, "force": force} | ({"tension": s} if tension else {})
        records.append(record_from_arrays(name, t, values))
    channels = (
        CaseChannel("displacement", "mm", "prescribed", 1e-6),
        CaseChannel("force", "N", "response", 0.3),
    )
    more = (CaseChannel("tension", "N", "scheduling"),) if tension else ()
    parameters = (
        NominalParameter("stiffness", 1.5, 0.05, "N/mm"),
        NominalParameter("coulomb", 40.0, 4.0, "N"),
    )
    return Case("component", "damper", parameters, (*channels, *more), tuple(records[:-1]), (records[-1],))


def test_a_law_that_differs_between_records_is_that_law_times_a_number_in_each():
    case = component((60.0, 120.0, 90.0), tension=False)
    structure = structure_of(case, settings=DEFAULT)
    problem = Problem(case, structure, case.identification, settings=DEFAULT)
    place = structure.places[0]
    plain = Placed(effect_named("bouc_wen_hysteresis"), place)
    varied = Placed(differing(plain.effect, [record.name for record in problem.records]), place)
    assert varied.effect.name == "record_dependent_bouc_wen_hysteresis"
    still, eta, apart = np.zeros(len(problem.nominal)), plain.effect.grid()[0], np.log([0.5, 1.5])
    for record, factor in zip((*problem.records, *case.validation), (0.5, 1.5, 1.0), strict=True):
        force = {}
        for name, hypothesis, shape in (
            ("none", (), []),
            ("plain", (plain,), eta),
            ("varied", (varied,), [*(eta[0] + apart), *eta[1:]]),
        ):
            force[name] = problem.simulate(hypothesis, np.append(still, shape), record)[:, 0]
        own, of_plain = force["varied"] - force["none"], force["plain"] - force["none"]
        np.testing.assert_allclose(own, factor * of_plain, atol=1e-9 * np.abs(of_plain).max())


def test_sizes_that_hardly_differ_between_records_are_no_rival_of_one_size():
    case = component((60.0, 120.0, 90.0), tension=False)
    structure = structure_of(case, settings=DEFAULT)
    problem = Problem(case, structure, case.identification, settings=DEFAULT)
    plain = Placed(effect_named("coulomb_friction"), structure.places[0])
    varied = Placed(differing(plain.effect, [record.name for record in problem.records]), plain.place)
    still = np.zeros(len(problem.nominal))

    def explanation(placed, *sizes):
        start = np.append(still, np.log(sizes))
        return Explanation(((problem, fit(problem, (placed,), start=start, iterations=0)),))

    one, hardly, plainly = (
        explanation(plain, 1.0),
        explanation(varied, 0.97, 1.03),
        explanation(varied, 0.8, 1.2),
    )
    assert differs_in_vain(hardly, [one, hardly])
    assert not differs_in_vain(hardly, [hardly, plainly])  # nothing stands in for it
    assert not differs_in_vain(plainly, [one, plainly])
    assert not differs_in_vain(one, [one, hardly])


@pytest.mark.slow
def test_friction_that_follows_a_channel_is_named_with_its_sensitivity():
    diagnosis = diagnose(component((60.0, 120.0, 90.0), tension=True))
    (named,) = diagnosis.verdict.named
    assert named.name == "scheduled_coulomb_friction"
    assert named.channel == "tension"
    found = named.parameters
    assert abs(found["sensitivity"].value - 1.0) < 5 * found["sensitivity"].std + 0.01
    slope = found["friction_force"].value * found["sensitivity"].value / found["reference"].value
    assert slope == pytest.approx(0.4, rel=0.02)
    # what is left is a sample at each of the 24 reversals, on the wrong side of twice the friction: 2 sqrt(24 / 2500) of its rms at most
    assert diagnosis.verdict.gap.after < 2.0 * (24 / 2500) ** 0.5 < diagnosis.verdict.gap.before


@pytest.mark.slow
@pytest.mark.parametrize("changes", ["stiffness", "damping"])
def test_a_spring_or_a_damper_that_follows_a_channel_is_named_with_what_a_deviation_of_it_does(changes):
    """Oil that warms: the nominal numbers hold at the mean of the tests; the temperature of the judging record is another."""
    rng = np.random.default_rng(8)
    t = np.arange(3000) / RATE
    records, warm = [], []
    for i, (start, end) in enumerate(((20.0, 32.0), (30.0, 45.0), (25.0, 40.0))):
        q = 5.0 * np.sin(2 * np.pi * (0.8 + 0.3 * i) * t) + 2.0 * np.sin(2 * np.pi * 2.1 * t + i)
        v = np.gradient(q, t)
        temperature = np.linspace(start, end, len(t))
        less = 1.0 - 0.02 * (temperature - 32.0)
        k, c = (1.5 * less, 0.2) if changes == "stiffness" else (1.5, 0.2 * less)
        force = k * q + c * v + rng.normal(0.0, 0.05, len(t))
        values = {"displacement": q, "force": force, "oil": temperature}
        records.append(record_from_arrays("validation" if i == 2 else f"identification_{i}", t, values))
        warm.append(temperature)
    channels = (
        CaseChannel("displacement", "mm", "prescribed", 1e-6),
        CaseChannel("force", "N", "response", 0.05),
        CaseChannel("oil", "degC", "scheduling"),
    )
    parameters = (
        NominalParameter("stiffness", 1.5, 0.05, "N/mm"),
        NominalParameter("damping", 0.2, 0.02, "N s/mm"),
    )
    case = Case("damper", "damper", parameters, channels, tuple(records[:2]), (records[2],))
    verdict = diagnose(case).verdict
    (named,) = verdict.named
    assert (named.name, named.channel) == (f"scheduled_{changes}", "oil")
    own = {"stiffness": 1.5, "damping": 0.2}[changes]
    deviation = float(np.std(np.concatenate(warm[:2])))
    assert named.parameters["deviation"].value == pytest.approx(deviation)
    assert named.parameters[f"{changes}_change"].value == pytest.approx(-0.02 * own * deviation, rel=0.05)
    assert verdict.complete
    assert verdict.gap.after < 1.1 * verdict.gap.noise_floor


@pytest.mark.slow
def test_friction_that_differs_from_record_to_record_is_named_as_that():
    diagnosis = diagnose(component((70.0, 100.0, 130.0, 160.0), tension=False))
    first = diagnosis.explanations[0].hypothesis
    assert [placed.effect.name for placed in first] == ["record_dependent_friction"]
    problem, fitted = diagnosis.explanations[0].parts[0]
    values = first[0].effect.values(fitted.vector[len(problem.nominal) :], problem.scales_of(first[0]))
    nominal = (
        0.0 if first[0].effect.in_place else problem.split((), fitted.vector[: len(problem.nominal)])[0][1]
    )
    np.testing.assert_allclose(nominal + values, [28.0, 40.0, 52.0], rtol=0.02)
