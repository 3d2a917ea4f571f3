"""Loads that read nothing but their noise drive nothing."""

import numpy as np
import pytest

from bench.discrepancy import BlindOptions
from bench.discrepancy.blind.drawing import draw_case
from bench.discrepancy.case.idle_loads import idle, idle_notes, without_idle_noise
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of

T = np.arange(5000) / 500.0


@pytest.mark.parametrize(
    ("load", "is_idle"),
    [
        (0.0 * T, True),
        (0.02 * np.sin(2 * np.pi * 3.0 * T), True),  # a line far below the noise is not seen
        (0.3 * np.sin(2 * np.pi * 3.0 * T), False),
        (0.5 * np.exp(-(((T - 5.0) / 0.02) ** 2)) * 10.0, False),
        (1.5 + 0.0 * T, False),
    ],
    ids=["nothing", "a trifle", "a line", "a blow", "an offset"],
)
def test_a_load_is_idle_if_it_reads_nothing_but_its_noise(load, is_idle, rng):
    assert idle(load + rng.standard_normal(len(T)), 1.0) == is_idle


def test_more_noise_than_stated_is_a_load(rng):
    assert not idle(1.5 * rng.standard_normal(len(T)), 1.0)


@pytest.fixture(scope="module")
def joint():
    options = BlindOptions(shares=(1.0, 0.0, 0.0, 0.0), rigs=(0.0, 0.0, 1.0), sensors=("both",))
    return draw_case("joint", np.random.default_rng(3), options)[0]


def test_the_load_of_an_axis_that_nobody_drives_is_zero_and_has_no_noise(joint):
    case = without_idle_noise(joint)
    axial, torsional, both = case.identification
    assert not np.any(axial.values["torque"])
    assert not np.any(torsional.values["force"])
    assert np.array_equal(both.values["torque"], joint.identification[2].values["torque"])
    notes = idle_notes(joint, case)
    assert (
        notes[0]
        == "'torque' reads nothing but its stated noise in 'identification_axial': it counts as zero there"
    )
    assert len(notes) == 2
    problem = Problem(case, structure_of(case), case.identification)
    assert problem.load_noise_of(axial)[1] == 0.0
    assert problem.load_noise_of(axial)[0] == problem.load_noise[0] > 0.0


def test_friction_that_holds_an_axis_still_gains_by_the_noise_of_its_load_cell_and_by_nothing_else(joint):
    """Driven by that noise, the model of an axis moves; the axis does not."""

    def gain(case):
        structure = structure_of(case)
        torsional = next(g for g in structure.groups() if "theta1" in structure.restricted(g).dofs)
        structure = structure.restricted(torsional)
        problem = Problem(case, structure, case.identification[:1])  # only the force acts
        friction = next(
            p
            for p in placements(case, structure, [effect_named("coulomb_friction")])
            if p.place.name == "torsional"
        )
        free, held = (
            problem.residual(h, np.append(np.zeros(len(problem.nominal)), eta))
            for h, eta in (((), []), ((friction,), [3.0]))
        )
        return free @ free - held @ held

    assert gain(joint) > 25.0
    assert gain(without_idle_noise(joint)) == pytest.approx(0.0, abs=1e-6)
