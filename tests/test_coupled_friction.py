"""Friction that two neighbouring joints share: found where it is, in its sense, and put back into MuJoCo as a tendon."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from test_articulated import mjcf, problem_of, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import Findings, apply
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE, effect
from bench.discrepancy.articulated_search.placements import apart, placements
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joint_run import predict

LIMIT, DAMPING = 0.12, 0.06
TENDON = (
    '<tendon><fixed name="shared" frictionloss="{limit}" damping="{damping}" solreffriction="0.002 1" '
    'solimpfriction="0.9999 0.9999 0.001 0.5 2"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="{sense}"/></fixed></tendon>'
)


@pytest.fixture(scope="module")
def coupled(tmp_path_factory):
    """A folder: an arm whose second motor turns with the difference of both joints."""
    tendon = TENDON.format(limit=LIMIT, damping=DAMPING, sense=-1)
    truth = mjcf(servo=False).replace("<actuator>", f"{tendon}<actuator>")
    return write_case(tmp_path_factory.mktemp("coupled"), truth, servo=False)


def test_what_two_joints_turn_together_is_found_and_put_back(coupled):
    verdict = diagnose(read_case(coupled)).verdict
    (named,) = verdict.named
    assert (named.name, named.where) == ("coupled_friction", "shoulder+elbow")
    values = {name: x.value for name, x in named.parameters.items()}
    assert values["limit"] == pytest.approx(LIMIT, rel=0.1)
    assert values["damping"] == pytest.approx(DAMPING, rel=0.2)
    assert values["sense"] == -1.0
    assert verdict.complete
    put = apply(coupled / "model.xml", Findings((named,)))
    model = put.compiled()
    assert model.ntendon == 1
    assert model.tendon_frictionloss[0] == pytest.approx(values["limit"])
    assert np.ravel(model.tendon_damping)[0] == pytest.approx(values["damping"])
    np.testing.assert_allclose(model.wrap_prm[: model.nwrap], [1.0, -1.0])
    (change,) = put.changes
    assert change.form == "native"


def test_a_joint_at_rest_is_pulled_along_by_its_neighbour():
    n, step = 2000, 1e-3
    p = np.zeros(SLOTS)
    p[[Slot.GEAR, Slot.KP, Slot.RATIO, Slot.STRIBECK]] = 1.0
    p[Slot.LOW], p[Slot.HIGH] = -np.inf, np.inf
    p[Slot.PAIR_LIMIT], p[Slot.PAIR_SENSE] = 0.5, 1.0
    one, nothing = np.ones(n - 1), np.zeros(n - 1)

    def speed(beside):
        arrays = (0.2 * one, nothing, nothing, nothing, nothing)
        measured = (np.zeros(n), np.zeros(0))
        _, states = predict(
            p, arrays, nothing, step, 1, measured, np.zeros((2, 2)), np.zeros((1, 2)), beside=beside
        )
        return states[:, 1]

    # friction of 0.5 on an inertia of 0.2 against what the neighbour does, until both turn together not at all
    pulled = speed(3.0 * one)
    np.testing.assert_allclose(pulled[:800:200], -2.5 * step * np.arange(0, 800, 200), rtol=1e-6, atol=1e-9)
    assert pulled[-1] == pytest.approx(-3.0)
    np.testing.assert_allclose(speed(nothing), 0.0)


def test_pairs_are_neighbours_in_the_tree_and_share_no_joint(coupled):
    problem = problem_of(coupled)
    pairs = [p for p in placements(problem, CATALOGUE) if p.effect.site == "pair"]
    assert [(p.where, p.joints) for p in pairs] == [("shoulder+elbow", (0, 1))]
    assert problem.reached(tuple(pairs)) == (0, 1)
    friction = placements(problem, [effect("coulomb_friction")])
    assert apart([*friction, *pairs], pairs) == friction
    assert apart([*friction, *pairs], friction) == [*friction, *pairs]


def test_branches_are_no_neighbours():
    from bench.discrepancy.multibody.model import ArticulatedModel

    body = '<body name="{0}"><joint name="{0}" axis="0 1 0"/><inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .01"/>{1}</body>'
    held = (
        '<body name="plate"><inertial pos="0 0 0" mass=".1" diaginertia="1e-3 1e-3 1e-3"/>{}</body>'.format(
            body.format("c", "")
        )
    )
    tree = body.format("a", body.format("b", "") + held)
    drives = "".join(f'<motor name="{j}" joint="{j}"/>' for j in "abc")
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{tree}</worldbody><actuator>{drives}</actuator></mujoco>"
    )
    found = ArticulatedModel.of(model)
    names = [joint.name for joint in found.joints]
    assert {name: set(found.neighbours(i)) for i, name in enumerate(names)} == {
        "a": {"b", "c"},
        "b": {"a"},
        "c": {"a"},
    }
