"""MuJoCo with native laws against SciPy's integrators on the same kernels: error and observed order."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from bench import Element, Rig, simulate
from bench.laws import LAWS
from bench.laws.base import ForceLaw

MASS = 2.0
STIFFNESS = 800.0
DURATION = 1.0
MJCF = """<mujoco><option gravity="0 0 0"/><worldbody>
<body name="a"><joint name="x" type="slide"/><geom size=".1" mass="2" contype="0" conaffinity="0"/></body>
<body name="b" pos="0 1 0"><joint name="y" type="slide"/><geom size=".1" mass="2" contype="0" conaffinity="0"/></body>
</worldbody><actuator><motor name="push" joint="x"/><motor name="squeeze" joint="y" gear="0"/></actuator>
</mujoco>"""
AMPLITUDE = {"velocity": 1.0, "second": 0.4}

# Levels that matter at 1 m/s and 35 mm on a mass of 2 kg, and time scales that a step of 1 ms resolves: the defaults'
# regularisation velocity of 1 mm/s is crossed within a tenth of a step, and no integrator of fixed step follows that.
RESOLVED = 0.2
PARAMETERS: dict[str, dict[str, float]] = {
    "quadratic_stiffness": {"k2": 2000.0},
    "cubic_stiffness": {"k3": 1e5},
    "power_law_damping": {"regularisation_velocity": RESOLVED},
    "coulomb": {"regularisation_velocity": RESOLVED},
    "asymmetric_coulomb": {"regularisation_velocity": RESOLVED},
    "stribeck": {"regularisation_velocity": RESOLVED, "stribeck_velocity": 0.5},
    "time_varying_friction": {"regularisation_velocity": RESOLVED},
    "controlled_friction": {"regularisation_velocity": RESOLVED},
    "load_dependent_friction": {"regularisation_velocity": RESOLVED},
    "dahl": {"stiffness": 500.0},
    "lugre": {"bristle_stiffness": 500.0},
    "elastoplastic_friction": {"bristle_stiffness": 500.0},
    "jenkins": {"stiffness": 500.0},
    "jenkins_backlash": {
        "stiffness": 500.0,
        "soft_stiffness": 50.0,
        "clearance": 0.005,
        "limit_positive": 5.0,
        "limit_negative": 4.0,
    },
    "iwan": {"stiffness": 500.0},
    "printed_coupling": {
        "k0_axial": 50.0,
        "k0_torsional": 50.0,
        "clearance_axial": 0.01,
        "clearance_torsional": 0.01,
    },
}


def _pointer(array: NDArray) -> object:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def _element(law: ForceLaw) -> Element:
    moving = law.n_coordinates - law.n_inputs
    joints = ("x", "y")[:moving]
    inputs = ("squeeze",) * law.n_inputs
    return Element.of(law, *joints, inputs=inputs, name="e", **PARAMETERS.get(law.name, {}))


def _reference(law: ForceLaw, theta: NDArray, normal_force: float) -> NDArray:
    """Final (x, v) of the joints by DOP853 or Radau at rtol 1e-10 on the compiled kernels."""
    n = law.n_coordinates
    moving = n - law.n_inputs
    force, rate = law.force.compiled.ctypes, law.rate.compiled.ctypes if law.rate else None

    q, v, f = np.zeros(n), np.zeros(n), np.zeros(n)
    q[moving:] = normal_force
    z, zdot = np.zeros(len(law.states)), np.zeros(len(law.states))
    arguments = [_pointer(a) for a in (q, v, z, theta)]
    forces, rates = _pointer(f), _pointer(zdot)

    def field(t: float, y: NDArray) -> NDArray:
        q[:moving], v[:moving], z[:] = y[:moving], y[moving : 2 * moving], y[2 * moving :]
        f[:] = 0.0
        zdot[:] = 0.0
        force(t, *arguments, forces)
        if rate is not None:
            rate(t, *arguments, rates)
        return np.concatenate([v[:moving], -(STIFFNESS * q[:moving] + f[:moving]) / MASS, zdot])

    start = np.zeros(2 * moving + len(law.states))
    start[moving : 2 * moving] = list(AMPLITUDE.values())[:moving]
    start[2 * moving :] = law.start()
    atol = 1e-12
    result = solve_ivp(field, (0.0, DURATION), start, method="DOP853", rtol=1e-10, atol=atol, max_step=1e-3)
    assert result.success
    return result.y[: 2 * moving, -1]


def _mujoco(law: ForceLaw, timestep: float, normal_force: float) -> NDArray:
    rig = Rig("free decay", MJCF, (_element(law),), timestep=timestep)
    rig = rig.with_structure(stiffness={"x": STIFFNESS, "y": STIFFNESS})
    n = round(DURATION / timestep) + 1
    moving = law.n_coordinates - law.n_inputs
    initial = {
        joint: (0.0, speed) for joint, speed in zip(("x", "y")[:moving], AMPLITUDE.values(), strict=False)
    }
    record = simulate(rig, {"squeeze": np.full(n, normal_force)}, initial=initial)
    suffixes = [""] if moving == 1 else ["_1", "_2"]
    return np.array([record[f"e/{kind}{s}"][-1] for kind in ("displacement", "velocity") for s in suffixes])


def _scale(law: ForceLaw) -> NDArray:
    """Natural amplitude of displacement and velocity: what errors are relative to."""
    moving = law.n_coordinates - law.n_inputs
    speed = AMPLITUDE["velocity"]
    return np.array([speed / np.sqrt(STIFFNESS / MASS)] * moving + [speed] * moving)


def _errors(law: ForceLaw, timesteps: tuple[float, ...]) -> list[float]:
    normal_force = 10.0
    reference = _reference(law, _element(law).theta, normal_force)
    return [
        float(np.max(np.abs(_mujoco(law, dt, normal_force) - reference) / _scale(law))) for dt in timesteps
    ]


SMOOTH = [law for law in LAWS.values() if law.smoothness == "smooth"]
ROUGH = [law for law in LAWS.values() if law.smoothness != "smooth"]


@pytest.mark.slow
@pytest.mark.parametrize("law", SMOOTH, ids=lambda law: law.name)
def test_smooth_law_is_right_to_a_millionth_and_converges_with_order_four(law):
    coarse, fine = _errors(law, (2e-3, 1e-3))
    assert fine <= 1e-6
    if fine > 1e-11:  # below, the reference's own tolerance decides
        assert np.log2(coarse / fine) >= 3.5


@pytest.mark.slow
@pytest.mark.parametrize("law", ROUGH, ids=lambda law: law.name)
def test_rough_law_converges_at_the_order_its_kinks_or_jumps_allow(law):
    """A step across a kink errs by O(dt^2) at worst, one across a jump by O(dt); there are finitely many of either.

    The constant depends on where in the step the kink falls, so that single halvings say little: the order is read
    off a factor of 32 in dt, with the margin that a lucky coarse step needs.
    """
    coarse, fine = _errors(law, (2e-3, 6.25e-5))
    order = np.log(coarse / fine) / np.log(32.0)
    assert order >= {"continuous": 1.3, "discontinuous": 0.7}[law.smoothness]
