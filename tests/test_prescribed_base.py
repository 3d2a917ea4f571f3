"""Prescribed motion in the user's own MJCF: bases that shake, turn or are carried by a mocap body."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bench.discrepancy.case.reading import read_case
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.diagnosis import diagnose
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.mjcf_prescribed import prescribed_channels
from bench.discrepancy.model.rigs import structure_of
from bench.errors import FileFormatError, UnknownNameError
from bench.rig import Rig

STEP, DURATION = 0.002, 8.0
MASS, STIFFNESS, DAMPING = 0.8, 1500.0, 1.6
"""An oscillator of 6.9 Hz on its base [kg, N/m, N s/m]; the same numbers with [kg m^2, N m/rad, N m s/rad] where it turns."""


def model(
    kind: str = "slide", axis: str = "1 0 0", *, base: str = "", above: str = "", gravity: str = "0 0 0"
) -> str:
    # the same number, whether it slides or turns
    inertial = f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="{MASS} {MASS} {MASS}"/>'
    spring = f'type="{kind}" axis="{axis}" stiffness="{STIFFNESS}" damping="{DAMPING}"'
    return f"""<mujoco><option gravity="{gravity}"/><worldbody>{above}
<body name="table"><joint name="table" type="{kind}" axis="{axis}" {base}/>
<inertial pos="0 0 0" mass="3" diaginertia="2 2 2"/><site name="below"/>
<body name="mass"><joint name="spring" {spring}/>{inertial}<site name="top"/></body>
</body></worldbody><sensor>
<accelerometer name="top" site="top"/><accelerometer name="below" site="below"/>
<framepos name="where" objtype="site" objname="top"/>
<jointpos name="table_at" joint="table"/><jointpos name="angle" joint="spring"/></sensor></mujoco>"""


class Shaken:
    """Motions of an oscillator on a base that runs through a multisine from rest, by an integrator that no fit uses."""

    def __init__(self, seed: int, size: float, cubic: float) -> None:
        rng = np.random.default_rng(seed)
        self.omega = 2.0 * np.pi * np.linspace(1.0, 10.0, 19)
        self.phase = rng.uniform(0.0, 2.0 * np.pi, 19)
        self.size = size / self.omega**1.5
        self.t = np.arange(round(DURATION / STEP)) * STEP
        found = solve_ivp(
            lambda t, z: (z[1], self.relative(t, z, cubic)), (0.0, self.t[-1]), (0.0, 0.0), t_eval=self.t,
            method="DOP853", rtol=1e-9, atol=1e-12,
        )  # fmt: skip
        self.z = found.y[0]
        self.a = self.base(self.t, 2)
        self.x = self.base(self.t, 0)
        self.absolute = self.a + self.relative(self.t, found.y, cubic)

    def base(self, t, order):
        """Displacement of the base or a derivative of it; it sets off smoothly."""
        ramp = np.clip(np.asarray(t) / 1.0, 0.0, 1.0)
        parts = [ramp**4 * (35 - 84 * ramp + 70 * ramp**2 - 20 * ramp**3), 140 * ramp**3 * (1 - ramp) ** 3,
                 420 * ramp**2 * (1 - ramp) ** 2 * (1 - 2 * ramp)]  # fmt: skip
        angle = np.multiply.outer(t, self.omega) + self.phase
        displacement = np.sin(angle) @ self.size
        if order == 0:
            return parts[0] * displacement
        velocity = np.cos(angle) @ (self.size * self.omega)
        acceleration = -np.sin(angle) @ (self.size * self.omega**2)
        return parts[0] * acceleration + 2 * parts[1] * velocity + parts[2] * displacement

    def relative(self, t, z, cubic):
        force = STIFFNESS * z[0] + DAMPING * z[1] + cubic * z[0] ** 3
        return -force / MASS - self.base(t, 2)


UNITS = {"slide": ("m/s^2", "m", "N/m", "N s/m"), "hinge": ("rad/s^2", "rad", "N m/rad", "N m s/rad")}
G = 9.80665
MOCAP = '<body name="hand" mocap="true"/>'
WELD = '<equality><weld body1="hand" body2="table"/></equality></mujoco>'


def case_of(folder, channels, columns, *, xml, kind="slide", cubic=0.0, size=0.02):
    """A case folder: `columns` makes channel to (samples, noise) of a `Shaken`; its channels are as in nominal.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.xml").write_text(xml)
    units = UNITS[kind]
    nominal = {
        "rig": "model.xml",
        "parameters": {
            "stiffness:spring": {"value": STIFFNESS, "std": 15.0, "unit": units[2]},
            "damping:spring": {"value": DAMPING, "std": 0.1, "unit": units[3]},
        },
        "channels": channels,
    }
    (folder / "nominal.json").write_text(json.dumps(nominal))
    for seed, name in enumerate(("identification", "identification_2", "validation")):
        shaken, rng = Shaken(seed, size, cubic), np.random.default_rng(100 + seed)
        table = columns(shaken)
        head = ["time", *table]
        noisy = [samples + noise * rng.standard_normal(len(shaken.t)) for samples, noise in table.values()]
        np.savetxt(
            folder / f"{name}.csv",
            np.column_stack([shaken.t, *noisy]),
            "%.9g",
            ",",
            header=",".join(head),
            comments="",
        )
    return read_case(folder)


def response(channel: str, unit: str, noise: float, **more):
    return {channel: {"unit": unit, "noise_std": noise, **more}}


def prescribed(channel: str, unit: str, noise: float, **more):
    return {channel: {"unit": unit, "noise_std": noise, "role": "prescribed", **more}}


VARIANTS = {
    "a position that the table follows": (
        prescribed("table_at", "mm", 1e-3) | response("where", "mm", 5e-3),
        lambda s: {"table_at": (1e3 * s.x, 1e-3), "where": (1e3 * (s.x + s.z), 5e-3)},
        {"xml": model()},
    ),
    "a servo on the table": (
        prescribed("shaker", "m", 1e-6, joint="table", quantity="position") | response("angle", "m", 5e-6),
        lambda s: {"shaker": (s.x, 1e-6), "angle": (s.z, 5e-6)},
        {"xml": model(base='stiffness="4e4" frictionloss="3" range="-.5 .5" limited="true"').replace(
            "<sensor>", '<actuator><motor name="shaker_drive" joint="table"/></actuator><sensor>')},
    ),
    "accelerometers that show gravity, upside down, on a table welded to a mocap body": (
        prescribed("below", "g", 1e-4) | response("top", "m/s^2", 5e-3),
        lambda s: {"below": (1.0 - s.a / G, 1e-4), "top": (G - s.absolute, 5e-3)},
        {"xml": model(axis="0 0 -1", gravity=f"0 0 -{G}", above=MOCAP).replace("</mujoco>", WELD)},
    ),
    "a turntable": (
        prescribed("table", "rad/s^2", 1e-3, joint="table", quantity="acceleration") | response("angle", "rad", 5e-6),
        lambda s: {"table": (s.a, 1e-3), "angle": (s.z, 5e-6)},
        {"xml": model("hinge", "0 0 1"), "kind": "hinge"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", VARIANTS)
def test_the_nominal_model_follows_a_prescribed_motion_to_its_noise(name, tmp_path):
    channels, columns, more = VARIANTS[name]
    case = admitted(case_of(tmp_path / "case", channels, columns, **more)).case
    problem = Problem(case, structure_of(case), case.identification)
    nothing = np.zeros(len(problem.nominal))
    (column,) = problem.structure.channels
    assert all(np.std(record.values[column]) > 50.0 * problem.noise[0] for record in case.identification)
    # chi-squared of n residuals: off by five of its deviations at most
    residual = problem.residual((), nothing)
    assert abs(float(residual @ residual) / problem.n_residuals - 1.0) < 5.0 * np.sqrt(
        2.0 / problem.n_residuals
    )


def test_an_effect_on_a_shaken_base_is_found_and_none_on_the_model_itself(tmp_path):
    channels, columns, more = VARIANTS["a position that the table follows"]
    assert diagnose(case_of(tmp_path / "none", channels, columns, **more)).verdict.verdict == "none"
    channels = prescribed("below", "m/s^2", 1e-3) | response("top", "m/s^2", 5e-3)
    case = case_of(
        tmp_path / "cubic",
        channels,
        lambda s: {"below": (s.a, 1e-3), "top": (s.absolute, 5e-3)},
        xml=model(),
        cubic=4e6,
    )
    verdict = diagnose(case).verdict
    (effect,) = verdict.named
    assert (effect.name, effect.where) == ("cubic_stiffness", "spring")
    k3 = effect.parameters["k3"]
    assert abs(k3.value - 4e6) < 3.0 * k3.std < 0.1 * 4e6


@pytest.mark.parametrize(
    ("channel", "error", "words"),
    [
        (prescribed("top", "m/s^2", 1e-3), FileFormatError, "reads joints table, spring"),
        (prescribed("blow", "m/s^2", 1e-3), UnknownNameError, "below"),
        (prescribed("x", "m", 1e-3, joint="tables", quantity="position"), UnknownNameError, "table"),
    ],
)
def test_a_prescribed_motion_is_that_of_one_joint(channel, error, words, tmp_path):
    name = next(iter(channel))
    channels = channel | response("angle", "m", 1e-6)
    case = case_of(
        tmp_path / "case", channels, lambda s: {name: (s.x, 0.0), "angle": (s.z, 0.0)}, xml=model()
    )
    rig = Rig.from_file(tmp_path / "case" / "model.xml")
    with pytest.raises(error, match=words):
        prescribed_channels(case, rig)
