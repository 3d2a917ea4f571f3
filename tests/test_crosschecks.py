"""Our laws against MuJoCo's own relatives of them: two codes, one physics."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from bench import Element, Rig, simulate
from bench.measurement import Chain, Delay

MJCF = """<mujoco><option gravity="0 0 0"/><worldbody>
<body name="mass"><joint name="x" type="slide" {joint}/><geom size=".1" mass="2" contype="0" conaffinity="0"/></body>
</worldbody>{tendon}<actuator><motor name="push" joint="x" {motor}/></actuator>
<sensor><jointpos name="position" joint="x"/></sensor></mujoco>"""
STEPS = 3000


def push(amplitude: float) -> dict[str, np.ndarray]:
    t = np.arange(STEPS) * 1e-3
    return {"push": amplitude * np.sin(2.0 * np.pi * 2.0 * t) * np.minimum(t, 1.0)}


def both(
    *elements: Element,
    joint: str = "",
    ours_joint: str = "",
    tendon: str = "",
    amplitude: float = 40.0,
    timestep: float = 1e-3,
):
    """Positions with MuJoCo's own effect and with ours, under the same push."""
    theirs = Rig("theirs", MJCF.format(joint=joint, tendon=tendon, motor=""), timestep=timestep)
    ours = Rig("ours", MJCF.format(joint=ours_joint, tendon="", motor=""), elements, timestep=timestep)
    drive = {"push": np.repeat(push(amplitude)["push"], round(1e-3 / timestep))}
    return simulate(theirs, drive)["position"], simulate(ours, drive)["position"]


def test_polynomial_stiffness_of_a_joint():
    elements = (
        Element.of("linear", "x", stiffness=500.0, damping=0.0),
        Element.of("quadratic_stiffness", "x", k2=2000.0),
        Element.of("cubic_stiffness", "x", k3=4e4),
    )
    theirs, ours = both(*elements, joint='stiffness="500 2000 40000"')
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_quadratic_damping_of_a_joint():
    """With RK4 MuJoCo adds the damping force as a passive force, like ours: equal to rounding."""
    elements = (
        Element.of("linear", "x", stiffness=500.0, damping=3.0),
        Element.of("quadratic_damping", "x", c2=20.0),
    )
    theirs, ours = both(*elements, joint='stiffness="500" damping="3 20 0"')
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_dead_space_is_a_tendon_spring_with_a_length_range():
    tendon = '<tendon><fixed name="t" stiffness="3000" springlength="-0.01 0.01"><joint joint="x" coef="1"/></fixed></tendon>'
    theirs, ours = both(Element.of("gap", "x", stiffness=3000.0, clearance=0.01), tendon=tendon)
    assert np.max(np.abs(ours)) > 0.02
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_jenkins_element_is_an_elasto_plastic_joint_spring():
    """MuJoCo shifts the spring's reference once a step, which is of first order in the step: 0.13 % at 2e-4 s.

    With RK4 its shift lags the stages and the difference is seven times larger, so theirs runs with Euler.
    """
    timestep = 5e-5
    elements = (
        Element.of("jenkins", "x", stiffness=2000.0, limit=10.0, transition=0.02),
        Element.of("linear", "x", stiffness=500.0, damping=1.0, name="ground"),
    )
    tendon = (
        '<tendon><fixed name="t" stiffness="500" damping="1"><joint joint="x" coef="1"/></fixed></tendon>'
    )
    mjcf = MJCF.format(joint='stiffness="2000" springyield="0.005"', tendon=tendon, motor="")
    drive = {"push": np.repeat(push(30.0)["push"], round(1e-3 / timestep))}
    theirs = simulate(Rig("theirs", mjcf, timestep=timestep, integrator="Euler"), drive)["position"]
    ours = simulate(
        Rig("ours", MJCF.format(joint="", tendon="", motor=""), elements, timestep=timestep), drive
    )["position"]
    assert np.max(np.abs(theirs)) > 0.02  # far beyond yield at 5 mm
    assert np.max(np.abs(ours - theirs)) < 1e-3 * np.max(np.abs(theirs))


def test_coulomb_friction_is_friction_loss_as_its_constraint_is_made_stiff():
    """MuJoCo's default friction constraint is soft (3.7 % off here); `exact=True` makes it as stiff as the step allows.

    What remains is the regularised law's creep and the constraint's own time constant of two steps.
    """
    spring = Element.of("linear", "x", stiffness=500.0, damping=1.0, name="spring")
    friction = Element.of("coulomb", "x", limit=5.0, regularisation_velocity=1e-3)
    mjcf = MJCF.format(joint="", tendon="", motor="")
    drive = {"push": np.repeat(push(30.0)["push"], 4)}
    smooth, exact = (
        simulate(Rig("ours", mjcf, (spring, law), timestep=2.5e-4), drive)["position"]
        for law in (friction, friction.with_(exact=True))
    )
    assert np.max(np.abs(exact - smooth)) < 2e-3 * np.max(np.abs(smooth))


@pytest.mark.parametrize("samples", [3, 10])
def test_delay_is_an_actuator_delay(samples):
    delayed = MJCF.format(
        joint='stiffness="500"', tendon="", motor=f'delay="{samples * 1e-3}" nsample="{samples}"'
    )
    plain = MJCF.format(joint='stiffness="500"', tendon="", motor="")
    drive = push(40.0)
    theirs = simulate(Rig("theirs", delayed, integrator="Euler"), drive)["position"]
    chain = Chain(Delay(time=samples * 1e-3))
    late = {"push": chain.apply(drive["push"], 1000.0, np.random.default_rng(0))}
    ours = simulate(Rig("ours", plain, integrator="Euler"), late)["position"]
    np.testing.assert_allclose(ours, theirs, atol=1e-9 * np.max(np.abs(theirs)) + 1e-12)


def test_prescribed_bouc_wen_loop_is_the_laws_own_integral():
    """Not MuJoCo's relative but its integrator: the state in `act` follows dz/dt along the motion."""
    element = Element.of("bouc_wen", "x", A=800.0, beta=40.0, gamma=20.0, n=1.0)
    rig = Rig("ours", MJCF.format(joint='stiffness="500"', tendon="", motor=""), (element,))
    record = simulate(rig, push(40.0))
    x, z = record[f"{element.name}/displacement"], record[f"{element.name}/z"]
    assert np.array_equal(record[f"{element.name}/force"], z)
    # ultimate force A / (beta + gamma) at n = 1
    assert np.max(np.abs(z)) < 800.0 / 60.0
    loop_work = float(np.trapezoid(z, x))
    assert loop_work > 0.0
    assert isinstance(rig.model, mujoco.MjModel)
