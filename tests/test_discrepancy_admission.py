"""What holds before any fit: units by the model, no factor or sign of the recording, and a nominal simulation that is the user's model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from planted_cases import motion_with, planted_case

from bench.discrepancy import Case, read_case
from bench.discrepancy.case.rig_units import in_coherent_units
from bench.discrepancy.checks.admission import admitted
from bench.discrepancy.checks.bands import Bands, common_factor, compare_channels
from bench.discrepancy.checks.load_limits import clipped_load
from bench.discrepancy.checks.scales import suspicions
from bench.discrepancy.judgement.shares import closed_words, percent, probability
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.verdict import Gap
from bench.errors import BenchError, ModelError, UnitError
from bench.recording.units import conversion, read_as

STEP, SAMPLES = 2e-3, 1500
NOISE = 2e-3
"""Noise of the made records, as a part of the motion."""
MODEL = """<mujoco><compiler angle="radian"/><option timestep="0.0005" integrator="RK4" gravity="0 0 {gravity}" {option}>
<flag {flag}/></option><worldbody>{world}<body name="table" {body}>
<inertial pos="0 0 0" mass="2.4" diaginertia=".01 .01 .01"/>
<joint name="guide" type="{kind}" axis="{axis}" stiffness="{stiffness}" damping="{damping}" {joint}/>
<geom name="block" type="box" size=".05 .05 .05"/>{child}</body>{bodies}</worldbody>
<tendon>{tendon}</tendon><equality>{equality}</equality>
<actuator>{actuator}</actuator><sensor><jointpos name="x" joint="guide" {sensor}/></sensor></mujoco>"""
PLAIN = {
    "gravity": "0", "option": "", "flag": 'contact="disable"', "world": "", "body": "", "kind": "slide", "axis": "1 0 0",
    "stiffness": "1500", "damping": "6", "joint": "", "child": "", "bodies": "", "tendon": "", "equality": "",
    "actuator": '<motor name="shaker" joint="guide"/>', "sensor": "",
}  # fmt: skip
OTHER = (
    '<body name="other"><inertial pos="0 0 0" mass="0.5" diaginertia=".01 .01 .01"/>'
    '<joint name="aux" type="slide" axis="0 1 0" damping="2"/><geom name="ball" size=".02"/></body>'
)


def fixed(inside: str = "") -> str:
    return f'<fixed name="t" {inside}><joint joint="guide" coef="1"/></fixed>'


def wall(at: float) -> str:
    return f'<geom name="wall" type="box" pos="{at} 0 0" size=".01 .1 .1"/>'


FEATURES: dict[str, dict[str, str]] = {
    "nothing": {},
    "springref": {"joint": 'springref="0.01"'},
    "gravity on a slide": {"gravity": "-9.81", "axis": "0 0 1"},
    "gravcomp": {"gravity": "-9.81", "axis": "0 0 1", "body": 'gravcomp="1"'},
    "forcerange": {"actuator": '<motor name="shaker" joint="guide" forcerange="-8 8"/>'},
    "actuatorfrcrange": {"joint": 'actuatorfrcrange="-8 8"'},
    "ctrlrange": {"actuator": '<motor name="shaker" joint="guide" ctrlrange="-8 8" ctrllimited="true"/>'},
    "gear": {"actuator": '<motor name="shaker" joint="guide" gear="3"/>'},
    "armature": {"joint": 'armature="0.7"'},
    "springdamper": {"joint": 'springdamper="0.1 0.3"', "stiffness": "0", "damping": "0"},
    "frictionloss": {"joint": 'frictionloss="2"'},
    "frictionloss of a tendon": {"tendon": fixed('frictionloss="2"')},
    "range": {"joint": 'range="-0.01 0.01" limited="true"'},
    "range of a tendon": {"tendon": fixed('range="-0.01 0.01" limited="true"')},
    "spring of a tendon": {"tendon": fixed('stiffness="700" damping="3"')},
    "slack of a tendon": {"tendon": fixed('stiffness="900" springlength="-0.005 0.005"')},
    "motor on a tendon": {"tendon": fixed(), "actuator": '<motor name="shaker" tendon="t" gear="2"/>'},
    "stiffness polynomial": {"stiffness": "1500 0 400000"},
    "damping polynomial": {"damping": "6 20"},
    "fluid": {"option": 'density="1000" viscosity="0.1"'},
    "linear equality": {
        "bodies": OTHER,
        "equality": '<joint joint1="aux" joint2="guide" polycoef="0 2 0 0 0" solref=".002 1" solimp=".999 .999 .001"/>',
    },
    "equality that bends": {"bodies": OTHER, "equality": '<joint joint1="aux" joint2="guide" polycoef="0 2 20 0 0"/>'},
    "equality switched off": {"bodies": OTHER, "equality": '<joint joint1="aux" joint2="guide" active="false"/>'},
    "weld": {"bodies": OTHER, "equality": '<weld body1="other" body2="table"/>'},
    "contact": {"flag": 'contact="enable"', "world": wall(0.065)},
    "contact out of reach": {"flag": 'contact="enable"', "world": wall(0.5)},
    "cutoff of a sensor": {"sensor": 'cutoff="0.01"'},
    "delay of a sensor": {"sensor": 'delay="0.01" nsample="40"'},
    "delay of an actuator": {"actuator": '<general name="shaker" joint="guide" delay="0.01" nsample="40"/>'},
    "filter": {"actuator": '<general name="shaker" joint="guide" dyntype="filterexact" dynprm="0.02"/>'},
    "servo": {"stiffness": "0", "actuator": '<position name="shaker" joint="guide" kp="1500" kv="6"/>'},
    "servo at its limit": {"stiffness": "100", "actuator": '<position name="shaker" joint="guide" kp="1500" forcerange="-8 8"/>'},
    "velocity servo": {"actuator": '<velocity name="shaker" joint="guide" kv="20"/>'},
    "damper as actuator": {"actuator": PLAIN["actuator"] + '<damper name="d" joint="guide" kv="5" ctrlrange="0 1"/>'},
    "welded child": {"child": '<body name="tool"><geom name="g" size=".03" mass=".6"/></body>'},
    "hinge": {"kind": "hinge", "axis": "0 1 0", "stiffness": "3", "damping": "0.02"},
}  # fmt: skip
KEPT = {
    "nothing", "springref", "gravity on a slide", "gravcomp", "forcerange", "actuatorfrcrange", "gear", "armature", "springdamper",
    "frictionloss", "frictionloss of a tendon", "spring of a tendon", "motor on a tendon", "linear equality", "equality switched off",
    "contact out of reach", "servo", "velocity servo", "welded child", "hinge",
}  # fmt: skip
"""Features that the nominal model has to keep; others may be refused."""


def load(seed: int, level: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal(SAMPLES))
    frequency = np.fft.rfftfreq(SAMPLES, STEP)
    spectrum[(frequency < 0.3) | (frequency > 10.0)] = 0.0
    samples = np.fft.irfft(spectrum, SAMPLES)
    return level * samples / np.std(samples) * np.minimum(np.arange(SAMPLES) / 200.0, 1.0)


def run(model: mujoco.MjModel, samples: np.ndarray, substeps: int = 4) -> np.ndarray:
    """Readings of the first sensor as MuJoCo makes them, loads running straight between samples."""
    model.opt.timestep = STEP / substeps
    data = mujoco.MjData(model)
    out = np.zeros(len(samples))
    following = np.append(samples[1:], samples[-1])
    for k, (now, after) in enumerate(zip(samples, following, strict=True)):
        for i in range(substeps):
            data.ctrl[0] = now + (i + 0.5) / substeps * (after - now)
            mujoco.mj_step(model, data)
            if i == 0:
                out[k] = data.sensordata[0]
    return out


def made(folder: Path, changes: dict[str, str], *, units: dict[str, str] | None = None) -> Path:
    """A case whose records are its nominal model run in MuJoCo, with noise."""
    text = MODEL.format(**{**PLAIN, **changes})
    model = mujoco.MjModel.from_xml_string(text)
    turns = changes.get("kind") == "hinge"
    commanded = model.actuator_biasprm[0, 1:3].any()
    (folder / "model.xml").write_text(text)
    runs = {
        name: (samples, run(model, samples))
        for seed, name in enumerate(("identification", "validation"))
        for samples in [load(seed, 0.02 if commanded else 0.5 if turns else 8.0)]
    }
    noise = NOISE * float(np.std(runs["identification"][1]))
    rng = np.random.default_rng(5)
    for name, (samples, motion) in runs.items():
        table = np.column_stack(
            [STEP * np.arange(SAMPLES), samples, motion + noise * rng.standard_normal(SAMPLES)]
        )
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header="time,load,x", comments="")
    welded = float(model.body_mass[model.body_weldid == 1].sum())
    parameters = {"mass:table": {"value": welded, "std": 0.03, "unit": "kg"}}
    if model.dof_damping[0] > 0.0 and "damping" not in changes:
        parameters["damping:guide"] = {"value": float(model.dof_damping[0]), "std": 0.5, "unit": "Ns/m"}
    unit = {"x": "rad" if turns else "m"} | {"load": "Nm" if turns else "N"}
    if commanded:
        unit["load"] = "m" if model.actuator_biasprm[0, 1] else "m/s"
    unit |= units or {}
    channels = {
        "load": {"unit": unit["load"], "role": "measured", "actuator": "shaker"},
        "x": {"unit": unit["x"], "noise_std": noise},
    }
    nominal = {"rig": "model.xml", "parameters": parameters, "channels": channels}
    (folder / "nominal.json").write_text(json.dumps(nominal))
    return folder


def unexplained(case: Case) -> float:
    """Chi-squared a sample of the nominal model, initial states fitted where a record starts in motion."""
    from bench.discrepancy.fitting.map_fit import fit

    problem = Problem(case, structure_of(case), case.identification)
    return fit(problem, (), start=np.zeros(len(problem.nominal))).reduced


@pytest.mark.slow
@pytest.mark.parametrize("feature", FEATURES)
def test_records_that_are_the_model_in_mujoco_are_explained_by_it_or_refused(tmp_path, feature):
    folder = made(tmp_path, FEATURES[feature])
    if feature not in KEPT:
        with pytest.raises(ModelError) as told:
            admitted(read_case(folder))
        assert "\n" not in str(told.value)
        return
    case = admitted(read_case(folder)).case
    # 750 pairs of samples: chi-squared is known to 4 %
    assert unexplained(case) < 1.15


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("Nm", "N m", 1.0), ("mNm", "N m", 1e-3), ("Ns/m", "N s/m", 1.0), ("g", "m/s^2", 9.80665), ("g", "kg", 1e-3),
        ("lb", "N", 4.4482216), ("lb", "kg", 0.45359237), ("lb in", "N m", 0.1129848), ("ft-lb", "N m", 1.3558179),
        ("lb/in", "N/m", 175.126835), ("rpm", "rad/s", np.pi / 30.0), ("deg", "rad", np.pi / 180.0), ("inch", "m", 0.0254),
        ("mm", "m", 1e-3), ("rev", "rad", 2.0 * np.pi), ("dps", "rad/s", np.pi / 180.0), ("oz in", "N m", 7.0615518e-3),
    ],
)  # fmt: skip
def test_a_unit_is_read_as_the_quantity_asks_for(unit, target, factor):
    read, fits = read_as(unit, (target,))
    assert conversion(read, fits) == pytest.approx((factor, 0.0), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "unit", "factor", "meant"),
    [("slide", "mm", 1e-3, "mm"), ("slide", "in", 0.0254, "in"), ("hinge", "°", np.pi / 180.0, "deg")],
)
def test_units_of_a_model_of_ones_own_are_converted_and_told(tmp_path, kind, unit, factor, meant):
    changes = FEATURES["hinge"] if kind == "hinge" else {}
    declared = read_case(made(tmp_path, changes, units={"x": unit}))
    scaled = replace(
        declared,
        channels=tuple(
            replace(c, noise_std=c.noise_std / factor) if c.name == "x" else c for c in declared.channels
        ),
        identification=tuple(scale(r, "x", 1.0 / factor) for r in declared.identification),
        validation=tuple(scale(r, "x", 1.0 / factor) for r in declared.validation),
    )
    case, notes = admitted(scaled)
    assert any(f"'x' is in {unit}" in note for note in notes)
    np.testing.assert_allclose(
        case.identification[0].values["x"], declared.identification[0].values["x"], rtol=1e-12
    )
    assert case.channel("x").unit == ("rad" if kind == "hinge" else "m")
    own = "rad" if kind == "hinge" else "m"
    mislabelled = replace(
        scaled, channels=tuple(replace(c, unit=own) if c.name == "x" else c for c in scaled.channels)
    )
    with pytest.raises(UnitError, match=f'write "unit": "{meant}"'):
        admitted(mislabelled)


@pytest.mark.parametrize(
    ("channel", "unit", "words"),
    [
        ("x", "kg", r'channels, "x": the unit is "kg".*"m".*write "unit": "m"'), ("x", "rad", '"m" or a unit'),
        ("load", "A", r"multiply the column by the constant of the motor or sensor \[N/A\]"), ("load", "kg", '"kgf"'),
        ("load", "m", '"N"'),
    ],
)  # fmt: skip
def test_units_of_another_dimension_are_refused_with_the_line_to_change(tmp_path, channel, unit, words):
    with pytest.raises(UnitError, match=words):
        admitted(read_case(made(tmp_path, {}, units={channel: unit})))


def scale(record, channel: str, factor: float):
    return replace(record, values={**record.values, channel: factor * record.values[channel]})


def scaled_case(case: Case, channel: str, factor: float) -> Case:
    return replace(
        case,
        identification=tuple(scale(r, channel, factor) for r in case.identification),
        validation=tuple(scale(r, channel, factor) for r in case.validation),
    )


def found(case: Case) -> tuple[str, ...]:
    return suspicions(case, Problem(case, structure_of(case), case.identification))


HIDDEN = {
    "nothing": planted_case(),
    "friction": planted_case(lambda f: motion_with(f, lambda x, v, z: (6.0 * np.tanh(v / 1e-3), []))),
    "stop": planted_case(lambda f: motion_with(f, lambda x, v, z: (20000.0 * max(x - 0.002, 0.0), []))),
}
"""Cases with a hidden force, which is no factor of anything."""


@pytest.mark.parametrize("hidden", HIDDEN)
def test_a_hidden_force_is_no_factor(hidden):
    assert found(HIDDEN[hidden]) == ()


@pytest.mark.parametrize("hidden", HIDDEN)
@pytest.mark.parametrize("factor", [1000.0, 1e-3, 9.80665, 57.29578, 25.4, -1.0])
@pytest.mark.parametrize("channel", ["displacement", "acceleration"])
def test_a_factor_or_sign_between_channels_is_found_whatever_is_hidden(hidden, channel, factor):
    [words] = found(scaled_case(HIDDEN[hidden], channel, factor))
    assert "'displacement'" in words
    assert "'acceleration'" in words
    assert ("opposite signs" in words) == (factor < 0.0)


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 9.80665, 4.44822, -1.0])
def test_a_factor_or_sign_against_the_model_is_found_and_the_load_named(factor):
    [words] = found(scaled_case(HIDDEN["nothing"], "force", factor))
    assert (
        "turn the sign of 'force'" if factor < 0.0 else "what the nominal model predicts from 'force'"
    ) in words
    if factor == 1000.0:
        assert '"unit": "mN" at nominal.json, channels, "force"' in words


def test_the_run_stops_before_any_fit_and_goes_on_when_asked():
    case = scaled_case(HIDDEN["nothing"], "displacement", 1000.0)
    with pytest.raises(UnitError, match="--anyway"):
        admitted(case)
    assert any("write" in note for note in admitted(case, anyway=True).notes)


def test_a_ratio_that_changes_from_band_to_band_is_no_factor():
    frequencies = np.geomspace(1.0, 30.0, 8)
    one = np.full(8, np.log(1000.0))
    assert common_factor(Bands(one, np.ones(8), frequencies))[0] == pytest.approx(1000.0)
    # friction of a geared joint makes any factor, of another course
    assert common_factor(Bands(-one, 0.3 * np.ones(8), frequencies), more=True) == (1.0, 1.0)
    assert common_factor(Bands(-one, np.ones(8), frequencies), more=True)[0] == pytest.approx(1e-3)
    assert common_factor(Bands(one, 0.3 * np.ones(8), frequencies), more=True)[0] == pytest.approx(1000.0)
    assert common_factor(Bands(one + np.linspace(-6.0, 6.0, 8), np.ones(8), frequencies)) == (1.0, 1.0)
    # a sign that turns within an octave is a resonance in another place
    assert common_factor(Bands(0.0 * one, -np.ones(8), np.linspace(1.0, 1.9, 8)))[1] == 1.0
    assert common_factor(Bands(0.0 * one, -np.ones(8), frequencies))[1] == -1.0


def test_a_clipped_load_keeps_what_it_does_between_samples():
    t = np.linspace(0.0, 6.8, 35)
    samples = (
        3.0 * np.sin(3.0 * t) * ((t > 0.3) & (t < 6.2))
    )  # at rest at both ends: samples there stand for half a step
    fine = np.linspace(0.0, 6.8, 34 * 400 + 1)
    truth = np.clip(np.interp(fine, t, samples), -1.0, 1.0)
    kept = clipped_load(samples, -1.0, 1.0, straight=True)
    cut = clipped_load(samples, -1.0, 1.0, straight=False)
    # impulse and its first moment; the integral over parts of a kink is good to their square
    for weight in (np.ones_like(fine), fine):
        exact = np.trapezoid(weight * truth, fine)
        size = np.trapezoid(np.abs(weight * truth), fine)
        assert np.trapezoid(weight * np.interp(fine, t, kept), fine) == pytest.approx(exact, abs=2e-4 * size)
    response = np.cumsum(np.interp(fine, t, kept) - truth)
    assert np.abs(response).max() < 0.5 * np.abs(np.cumsum(np.interp(fine, t, cut) - truth)).max()


def test_values_that_contradict_the_model_are_told_with_what_they_are_the_sum_of(tmp_path):
    folder = made(tmp_path, FEATURES["welded child"])
    nominal = json.loads((folder / "nominal.json").read_text())
    nominal["parameters"]["mass:table"]["value"] = 2.4
    (folder / "nominal.json").write_text(json.dumps(nominal))
    [note] = [n for n in admitted(read_case(folder), anyway=True).notes if "mass:table" in n]
    assert "20 sigma" in note
    assert "'table' 2.4 kg, 'tool' 0.6 kg" in note


def test_columns_that_nobody_names_are_listed(tmp_path):
    folder = made(tmp_path, {})
    for name in ("identification", "validation"):
        file = folder / f"{name}.csv"
        head, *rows = file.read_text().splitlines()
        file.write_text("\n".join([f"{head},tension", *(f"{row},1.5" for row in rows)]) + "\n")
    notes = read_case(folder).identification[0].notes
    assert [note for note in notes if "'tension'" in note and "not used" in note]


@pytest.mark.slow
def test_a_free_decay_needs_no_load(tmp_path):
    text = MODEL.format(**{**PLAIN, "actuator": "", "joint": 'ref="0"'})
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = STEP / 4
    (tmp_path / "model.xml").write_text(text)
    rng = np.random.default_rng(1)
    for name, start in (("identification", 0.02), ("validation", 0.03)):
        data = mujoco.MjData(model)
        data.qpos[0] = start
        motion = np.zeros(SAMPLES)
        for k in range(SAMPLES):
            motion[k] = data.qpos[0]
            mujoco.mj_step(model, data, 4)
        table = np.column_stack([STEP * np.arange(SAMPLES), motion + 2e-5 * rng.standard_normal(SAMPLES)])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="time,x", comments="")
    parameters = {"damping:guide": {"value": 6.3, "std": 0.5, "unit": "N s/m"}}
    channels = {"x": {"unit": "m", "noise_std": 2e-5}}
    (tmp_path / "nominal.json").write_text(
        json.dumps({"rig": "model.xml", "parameters": parameters, "channels": channels})
    )
    case = admitted(read_case(tmp_path)).case
    assert not any(record.at_rest for record in case.identification)
    assert unexplained(case) < 1.15


def test_a_rig_of_one_coordinate_may_turn():
    case = planted_case()
    names = {"force": "torque", "displacement": "angle", "acceleration": "angular_acceleration"}
    units = {"force": "Nm", "displacement": "deg", "acceleration": "rad/s^2"}
    constants = {"mass": "kg m^2", "stiffness": "N m/rad", "damping": "N m s/rad"}

    def turned(record):
        values = {
            names[n]: v * (180.0 / np.pi if n == "displacement" else 1.0) for n, v in record.values.items()
        }
        return replace(record, values=values)

    rotary = replace(
        case,
        parameters=tuple(replace(p, unit=constants[p.name]) for p in case.parameters),
        channels=tuple(replace(c, name=names[c.name], unit=units[c.name]) for c in case.channels),
        identification=tuple(turned(r) for r in case.identification),
        validation=tuple(turned(r) for r in case.validation),
    )
    converted, notes = in_coherent_units(rotary)
    assert any("'angle' is in deg" in note for note in notes)
    structure = structure_of(converted)
    assert (structure.places[0].position_unit, structure.places[0].force_unit) == ("rad", "N m")
    np.testing.assert_allclose(
        converted.identification[0].values["angle"], case.identification[0].values["displacement"], rtol=1e-12
    )


def gap(before: float, after: float, floor: float, interval=(0.5, 0.7)) -> Gap:
    closed = (before - after) / (before - floor)
    return Gap(
        "x NRMSE", before, before, after, floor, closed, interval, (("nominal", before), ("gap", after))
    )


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (gap(0.00201, 0.00197, 0.002), "nothing to close: it is that of the noise"),
        (gap(0.5, 0.01, 0.01, (0.9999, 1.0)), "over 99.9 %"),
        (gap(0.5, 0.2, 0.01), "61.2 % (50.0 to 70.0)"),
        (gap(0.5, 0.2, 0.01, (-400.0, 3.0)), "61.2 % (below -100 to over 99.9)"),
        (gap(0.5, 1.0, 0.01), "none: it grows to 2 times"),
        (gap(0.5, 1e3, 0.01), "none: it diverges"),
    ],
)
def test_shares_in_words_never_claim_more_than_the_whole(entry, words):
    assert closed_words(entry) == words


def test_no_probability_is_told_where_none_was_computed():
    assert probability(float("nan")) == probability(None) == "not computed"
    assert percent(1.0) == "over 99.9 %"


def test_every_refusal_is_a_line(tmp_path):
    with pytest.raises(BenchError) as told:
        admitted(read_case(made(tmp_path, FEATURES["servo at its limit"])))
    assert "\n" not in str(told.value)
    assert "forcerange" in str(told.value)


@pytest.mark.parametrize("true", [1.0, 9.80665])
def test_hum_in_two_sensors_of_one_motion_hides_no_factor_and_makes_none(true):
    rng, rate = np.random.default_rng(5), 500.0
    clock = np.arange(5000) / rate
    tones = np.linspace(1.0, 12.0, 40)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(tones))
    waves = np.sin(2.0 * np.pi * np.outer(clock, tones) + phases)
    x, a = waves @ tones**-2.0, -waves @ ((2.0 * np.pi) ** 2 * np.ones(len(tones)))
    # in phase as far as one motion of 50 Hz would be, and far too large for one: differentiated twice it is most of the first signal
    hum = np.sin(2.0 * np.pi * 50.0 * clock)
    noise = (1e-4 * x.std(), 1e-4 * a.std())
    pair = compare_channels(
        x + 0.05 * x.std() * hum + noise[0] * rng.standard_normal(len(x)),
        true * a - 0.05 * a.std() * hum + noise[1] * rng.standard_normal(len(x)),
        orders=(0, 2), noise=noise, step=1.0 / rate,
    )  # fmt: skip
    assert pair is not None
    assert pair.factor == pytest.approx(true, rel=0.05)
    assert pair.sign > 0.9
