"""Environments: contracts of gymnasium, hidden rigs in MuJoCo, rewards, limits, observations, determinism."""

from __future__ import annotations

import inspect
import pickle
import subprocess
import sys
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import envs
from bench import simulate
from bench.errors import BenchError, ModelError
from bench.excitation import RigHypothesis, Uncertain
from bench.excitation.shaping import SHAPINGS, Shaping
from envs import rendering, single
from envs.laboratory import Laboratories, combined
from envs.options import Options
from envs.setups import PAIRS, SDOF_LAWS, discrimination_setup, joint_setup, sdof_setup
from envs.stepped import FLOATS

SDOF, JOINT, DISCRIMINATION = envs.IDS[:3]
QUICK: dict[str, Any] = {"rig": "sdof", "pairs": ("gap_cubic", "coulomb_stribeck"), "n_draws": 2}
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    (SDOF, {}),
    (SDOF, {"shaping": "amplitude_frequency", "enforcement": "cost", "average": "posterior"}),
    (SDOF, {"laws": ("gap",), "n_knots": 2, "window": 0.08, "duration": 1.0, "n_draws": 3, "penalty": 0.0}),
    (SDOF, {"laws": ("bouc_wen", "coulomb")}),
    (SDOF, {"reward": "error"}),
    (JOINT, {}),
    (JOINT, {"reward": "coverage", "n_draws": 1}),
    (JOINT, {"reward": "error"}),
    (JOINT, {"shaping": "amplitude_frequency", "n_draws": 2, "average": "posterior"}),
    (DISCRIMINATION, {}),
    (DISCRIMINATION, {**QUICK, "shaping": "amplitude_frequency"}),
    (DISCRIMINATION, {**QUICK, "terminate_when_certain": True, "average": "posterior"}),
]


def name_of(variant: Any) -> str:
    return variant[11:16] if isinstance(variant, str) else "-".join(variant) or "defaults"


def make(identifier: str, **arguments: Any) -> single.BenchEnv:
    return gymnasium.make(identifier, **arguments).unwrapped  # type: ignore[return-value]


@pytest.mark.parametrize(("identifier", "arguments"), VARIANTS, ids=name_of)
def test_gymnasium_finds_nothing_to_complain_of(identifier: str, arguments: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(identifier, **arguments), skip_render_check=True)  # pictures need OpenGL: see below


@pytest.mark.slow
def test_ids_can_be_made_by_their_module() -> None:
    code = (
        "import sys, gymnasium; env = gymnasium.make('envs:JointBench/SDOFExcitation-v0'); env.reset(seed=0); "
        "print([m for m in ('torch', 'stable_baselines3', 'cmaes', 'OpenGL') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(("identifier", "arguments"), VARIANTS[1::3], ids=name_of)
def test_episodes_repeat_from_their_seed_and_survive_pickling(
    identifier: str, arguments: dict[str, Any]
) -> None:
    env, other = make(identifier, **arguments), make(identifier, **arguments)
    env.action_space.seed(1)
    first, second = env.reset(seed=11), other.reset(seed=11)
    np.testing.assert_array_equal(first[0], second[0])
    for step in range(24):
        action = env.action_space.sample()
        if step == 9:
            other = pickle.loads(pickle.dumps(other))
        if step == 14:
            first, second = env.reset(), other.reset()  # the next hidden rig comes from the same stream
            np.testing.assert_array_equal(first[0], second[0])
        a, b = env.step(action), other.step(action)
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1:] == b[1:]
    assert dict(env.truth.values) == dict(other.truth.values)
    assert not np.array_equal(make(identifier, **arguments).reset(seed=12)[0], env.reset(seed=11)[0])


def test_info_holds_plain_numbers() -> None:
    env = make(DISCRIMINATION, **QUICK)
    _, info = env.reset(seed=0)
    _, reward, *ends, later = env.step(env.action_space.sample())
    assert set(info) == set(later) == {*FLOATS, "violation"}
    for entries in (info, later):
        assert all(type(entries[name]) is float for name in FLOATS)
        assert type(entries["violation"]) is bool
    assert type(reward) is float
    assert all(type(end) is bool for end in ends)


@pytest.mark.parametrize(
    "setup", [sdof_setup(), joint_setup(), discrimination_setup(**{**QUICK, "pairs": PAIRS[:3]})], ids=["sdof", "joint", "rivals"]
)  # fmt: skip
def test_laboratories_hold_the_hidden_rig(setup: Any) -> None:
    """What ideal sensors show is what MuJoCo gives for the drawn rig on its own, window by window, law by law."""
    priors = [q if hasattr(q, "hypotheses") else q.prior for q in setup.questions]
    hypotheses = tuple(h for prior in priors for h in prior.hypotheses)
    channels, actuators = tuple(setup.noise), setup.limits.actuators
    laboratories = Laboratories(
        hypotheses, len(hypotheses), channels=channels, actuators=actuators, threads=2
    )
    rng = np.random.default_rng(0)
    draws = [h.at(rng.uniform(-1.5, 1.5, len(h.parameters))) for h in hypotheses]
    for _ in range(2):  # the second time over: nothing of the first rig may stay
        draws = draws[::-1] if len(hypotheses) > 1 and draws[0].hypothesis is hypotheses[0] else draws
        for place, draw in enumerate(draws):
            laboratories.install(place, draw)
        force = np.array([setup.limits.force[name] for name in actuators])
        u = force * np.sin(np.linspace(0.0, 25.0, 150)[:, None] + np.arange(len(actuators)))
        everyone = np.arange(len(draws))
        parts = [laboratories.run(everyone, np.tile(part, (len(draws), 1, 1))) for part in np.split(u, 3)]
        shown = np.concatenate(parts, axis=1)
        for place, draw in enumerate(draws):
            record = simulate(draw.rig, dict(zip(actuators, u.T, strict=True)))
            for column, name in enumerate(channels):
                # The same model but for what is drawn and unread sensors: rounding only.
                scale = np.max(np.abs(record[name])) + 1e-12
                np.testing.assert_allclose(shown[place, :, column], record[name], atol=1e-9 * scale)


def test_laboratories_refuse_what_they_cannot_tell_apart() -> None:
    gap, other = sdof_setup().questions[0].hypotheses[:2]
    clash = RigHypothesis(
        "clash",
        other.rig.with_(elements=[other.rig.elements[0].with_(name="gap")]),
        (Uncertain("gap.A", 1.0, 2.0),),
    )
    with pytest.raises(ModelError, match="another law under the name 'gap'"):
        combined((gap, clash), ("displacement",))
    heavy = RigHypothesis("heavy", gap.rig, (Uncertain("mass:carriage", 1.0, 2.0),))
    with pytest.raises(ModelError, match="cannot differ between laboratories"):
        Laboratories((heavy,), 1, channels=("displacement",), actuators=("shaker",))


@pytest.mark.parametrize(
    ("identifier", "arguments"), [(SDOF, {}), (JOINT, {}), (DISCRIMINATION, QUICK)], ids=name_of
)
def test_rewards_add_up_to_the_merit_of_the_whole_record(identifier: str, arguments: dict[str, Any]) -> None:
    env = make(identifier, enforcement="cost", penalty=0.0, **arguments)
    env.reset(seed=3)
    benches = env.benches
    commands, total = [], 0.0
    rng = np.random.default_rng(0)
    keep = benches._laboratories.run
    benches._laboratories.run = lambda places, u: (commands.append(u[0]), keep(places, u))[1]  # type: ignore[method-assign]
    for _ in range(40):
        _, reward, *_, info = env.step(rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32))
        total += reward
        assert info["gain"] == pytest.approx(reward)
    study = benches.setup.experiments[int(benches.question[0])]
    merit = float(study.merit(np.concatenate(commands)[None])[0])
    assert total == pytest.approx(merit, rel=1e-6)  # sums over windows in another order
    assert info["merit"] == pytest.approx(total)
    assert merit > 0.1


def test_rewards_do_not_know_the_hidden_rig() -> None:
    env = make(SDOF, enforcement="cost", penalty=0.0)
    rewards = []
    for seed in (0, 1):
        env.reset(seed=seed)
        rewards.append([env.step(np.array([0.8], dtype=np.float32))[1] for _ in range(20)])
    assert rewards[0] == rewards[1]


def test_posterior_weights_move_towards_rigs_like_the_hidden_one() -> None:
    env = make(SDOF, average="posterior", enforcement="cost", shaping="amplitude_frequency")
    benches = env.benches
    closer = []
    for seed in range(6):
        env.reset(seed=seed)
        for step in range(120):
            octave = -0.6 + 1.2 * step / 120
            _, _, *_, info = env.step(np.array([0.5, octave], dtype=np.float32))
        assert 1.0 <= info["effective_draws"] <= 6.0 + 1e-9
        drawn = [draw.values["stiffness:carriage"] for draw in benches.setup.experiments[0].draws]
        place = np.arange(1)
        prior = np.full((1, 6), 1.0 / 6.0)
        weights = benches._probability(
            prior, benches._fisher, benches._score, benches._square, benches.desk.window[place]
        )
        truth = env.truth.values["stiffness:carriage"]
        distance = np.abs(np.log(np.array(drawn) / truth))
        closer.append(float(distance.mean() - weights[0] @ distance))
    # A gap or friction changes the apparent stiffness, so that single episodes may err.
    assert np.mean(closer) > 0.0


@pytest.mark.parametrize("enforcement", ["terminate", "cost"])
def test_the_stroke_limit_trips_or_costs(enforcement: str) -> None:
    env = make(SDOF, enforcement=enforcement, shaping="amplitude_frequency", laws=("coulomb",), penalty=7.0)
    broken = False
    for seed in range(12):
        env.reset(seed=seed)
        frequency = np.sqrt(env.truth.values["stiffness:carriage"] / 2.0) / (2.0 * np.pi)
        octave = 2.0 * np.log(frequency / 0.5) / np.log(10.0) - 1.0
        for _ in range(200):
            _, reward, terminated, truncated, info = env.step(np.array([1.0, octave], dtype=np.float32))
            assert reward == pytest.approx(info["gain"] - info["cost"])
            if info["stroke"] > 1.0:
                broken = True
                assert info["violation"]
                assert terminated == (enforcement == "terminate" or info["energy"] >= 1.0 - 1e-9)
                worst = (
                    7.0
                    if enforcement == "terminate"
                    else 7.0 * (min(info["stroke"] - 1.0, 1.0) + min(max(info["velocity"] - 1.0, 0.0), 1.0))
                )
                assert info["cost"] == pytest.approx(worst)
            elif not info["violation"]:
                assert info["cost"] == 0.0
            if terminated or truncated:
                break
    assert broken  # at resonance the shaker does reach the limit


@pytest.mark.parametrize("enforcement", ["terminate", "cost"])
def test_a_simulation_that_diverges_ends_the_episode(enforcement: str) -> None:
    env = make(SDOF, enforcement=enforcement, penalty=3.0)
    env.reset(seed=0)
    env.step(np.ones(1, dtype=np.float32))
    run = env.benches._laboratories.run
    env.benches._laboratories.run = lambda places, u: run(places, u) * np.nan  # type: ignore[method-assign]
    observation, reward, terminated, _, info = env.step(np.ones(1, dtype=np.float32))
    assert terminated
    assert info["violation"]
    assert info["cost"] >= 3.0
    assert np.isfinite(observation).all()
    assert np.isfinite(reward)


def test_the_energy_budget_is_kept_and_ends_the_episode() -> None:
    env = make(SDOF, enforcement="cost", laws=("bouc_wen",))
    env.reset(seed=0)
    for _ in range(200):
        *_, terminated, truncated, info = env.step(np.array([1.0], dtype=np.float32))
        assert info["energy"] <= 1.0 + 1e-12
        assert info["force"] <= 1.0
        if terminated:
            break
    assert info["energy"] == pytest.approx(1.0, abs=1e-9)
    assert not truncated
    assert info["time"] == pytest.approx(10.0 / 2.0**2, abs=0.08)  # 10 N^2 s at 2 N, within two windows


def test_episodes_last_as_long_as_asked() -> None:
    env = make(SDOF, duration=0.4)
    env.reset(seed=0)
    ends = [env.step(np.zeros(1, dtype=np.float32))[2:4] for _ in range(10)]
    assert ends == [(False, False)] * 9 + [(False, True)]


def test_observations_are_measurements_of_the_last_window() -> None:
    env = make(SDOF)
    env.reset(seed=5)
    place = np.arange(1)
    for _ in range(30):
        observation, *_, info = env.step(np.array([0.9], dtype=np.float32))
    assert observation.shape == (4 * 4 + 5,)
    assert np.max(np.abs(observation[:12:3])) == pytest.approx(info["stroke"], rel=1e-6)
    np.testing.assert_allclose(observation[12:16], 0.9, rtol=1e-6)  # the same knot again: a constant force
    np.testing.assert_allclose(observation[16:18], [0.9, 2.0 * 30 / 200 - 1.0], rtol=1e-6)
    assert observation[18] == pytest.approx(2.0 * info["energy"] - 1.0, abs=1e-6)
    # Noise is there, and it is the sensors': the position at rest is zero, and known no better than that.
    rest = np.array([env.reset(seed=s)[0][:12:3] for s in range(200)]) * 0.04
    assert np.std(rest) == pytest.approx(5e-4, rel=0.1)  # 800 numbers: 2.5 % one sigma
    assert env.benches.desk.window[place] == 0


@pytest.mark.parametrize("kind", SHAPINGS)
def test_commands_are_continuous_and_within_the_force(kind: str) -> None:
    shaping = Shaping(kind, 2, n_actuators=2, band=(1.0, 4.0), n_knots=2 if kind == "knots" else 1)
    places, rng = np.arange(2), np.random.default_rng(0)
    shaping.begin(places)
    windows = [
        shaping.commands(places, rng.uniform(-1.0, 1.0, (2, shaping.width)), 100, 1e-3) for _ in range(30)
    ]
    record = np.concatenate(windows, axis=1)
    assert np.max(np.abs(record)) <= 1.0
    # From −1 to 1 along half a cosine in 50 steps, or a sine of 4 Hz with a rising amplitude: at most 2 · pi/2 / 50.
    assert np.max(np.abs(np.diff(record, axis=1))) < 0.064
    alone = Shaping(kind, 1, n_actuators=2, band=(1.0, 4.0), n_knots=2 if kind == "knots" else 1)
    alone.begin(places[:1])
    action = rng.uniform(-1.0, 1.0, (2, shaping.width))
    shaping.begin(places)
    np.testing.assert_array_equal(
        alone.commands(places[:1], action[1:], 100, 1e-3)[0], shaping.commands(places, action, 100, 1e-3)[1]
    )


def test_a_steered_sine_has_the_frequency_asked_for() -> None:
    shaping = Shaping("amplitude_frequency", 1, n_actuators=1, band=(1.0, 4.0))
    shaping.begin(np.arange(1))
    shaping.commands(np.arange(1), np.array([[1.0, 1.0]]), 100, 1e-3)  # gets there
    record = np.concatenate(
        [shaping.commands(np.arange(1), np.array([[1.0, 1.0]]), 100, 1e-3)[0, :, 0] for _ in range(20)]
    )
    spectrum = np.abs(np.fft.rfft(record))
    assert np.argmax(spectrum) / 2.0 == 4.0  # lines of 0.5 Hz over 2 s
    assert np.max(np.abs(record)) == pytest.approx(1.0, abs=1e-3)


def test_time_steps_are_short_enough() -> None:
    """Against a tenth of the step, what the drawn rigs do differs by at most 2 % of the stroke limit."""
    for setup in (sdof_setup(), joint_setup()):
        study = setup.experiments[0]
        n = round(3.0 / study.timestep)
        rng = np.random.default_rng(0)
        knots = rng.uniform(-1.0, 1.0, (n // 8 + 1, len(study.actuators)))
        force = np.array([study.limits.force[name] for name in study.actuators])
        u = force * np.repeat(knots, 8, axis=0)[:n]
        for draw in study.rigs_drawn:
            rig = draw.rig
            coarse = simulate(rig, dict(zip(study.actuators, u.T, strict=True)))
            fine = simulate(
                rig.with_(timestep=rig.timestep / 10.0),
                dict(zip(study.actuators, np.repeat(u, 10, axis=0).T, strict=True)),
            )
            for name, limit in study.limits.stroke.items():
                assert np.max(np.abs(coarse[name] - fine[name][::10])) < 0.02 * limit


def test_pictures_show_the_simulated_positions(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    class Renderer:
        def __init__(self, model: Any, height: int, width: int) -> None:
            assert model.ngeom > 20  # the whole apparatus, not what is simulated
            self.shape = (height, width, 3)

        def update_scene(self, data: Any, camera: int) -> None:
            assert data.model.camera(camera).name == rendering.CAMERA
            seen.append(data.qpos.copy())

        def render(self) -> np.ndarray:
            return np.zeros(self.shape, dtype=np.uint8)

        def close(self) -> None:
            seen.append("closed")

    monkeypatch.setattr(rendering.mujoco, "Renderer", Renderer)
    env = make(JOINT, render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(5):
        env.step(np.ones(2, dtype=np.float32))
    assert env.render().shape == (480, 640, 3)
    np.testing.assert_array_equal(seen[0], env.benches.positions(0))
    assert np.any(seen[0] != 0.0)
    env.close()
    assert seen[-1] == "closed"


def test_documentation_states_every_argument_and_limit() -> None:
    for cls, setup in (
        (single.SDOFExcitationEnv, sdof_setup()),
        (single.JointExcitationEnv, joint_setup()),
        (single.DiscriminationEnv, None),
    ):
        text = inspect.getdoc(cls) or ""
        for section in (
            "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End", "Arguments", "Version History",
        ):  # fmt: skip
            assert f"## {section}" in text, (cls, section)
        if setup is not None:
            for name, level in setup.noise.items():
                assert name.removesuffix("_x") in text, name
                assert any(f"{value:g}" in text for value in (level, 1e3 * level)), (name, level)
            for table in (setup.limits.force, setup.limits.watched):
                assert all(f"{value:g}" in text for value in table.values()), cls
            for hypothesis in setup.questions[0].hypotheses:
                for parameter in hypothesis.parameters:
                    low, high = (
                        f"{v:.0e}".replace("e+0", "e") if v > 1500.0 else f"{v:g}"
                        for v in (parameter.low, parameter.high)
                    )
                    assert f"| {low} | {high} |" in text, parameter
    text = inspect.getdoc(single.SDOFExcitationEnv) or ""
    for field in Options.__dataclass_fields__:
        assert f"`{field}`" in text or field == "terminate_when_certain", field
    assert "`terminate_when_certain`" in (inspect.getdoc(single.DiscriminationEnv) or "")
    assert all(pair in (inspect.getdoc(single.DiscriminationEnv) or "") for pair in PAIRS)
    assert all(law in text for law in SDOF_LAWS)


@pytest.mark.parametrize(
    ("identifier", "arguments", "message"),
    [
        (SDOF, {"laws": ("gab",)}, "Did you mean 'gap'"),
        (SDOF, {"shaping": "knot"}, "Did you mean 'knots'"),
        (SDOF, {"enforcement": "stop"}, "terminate"),
        (SDOF, {"average": "mean"}, "posterior"),
        (SDOF, {"reward": "eror"}, "Did you mean 'error'"),
        (DISCRIMINATION, {**QUICK, "reward": "error"}, "rivals have not"),
        (SDOF, {"window": 1e-4}, "at least one step"),
        (SDOF, {"n_knots": 0}, "at least one"),
        (SDOF, {"n_draws": 1}, "at least one each"),
        (DISCRIMINATION, {"rig": "sdof", "pairs": ("axial_gap_coupling",)}, "pair of effects on rig 'sdof'"),
        (DISCRIMINATION, {"rig": "chain"}, "rig of the discrimination environment"),
        (SDOF, {"penalty": -1.0}, "penalty"),
        (SDOF, {"penalty": None}, "penalty"),
        (SDOF, {"window": float("nan")}, "window is nan"),
        (SDOF, {"duration": float("inf")}, "duration is inf"),
        (SDOF, {"n_knots": 1.5}, "n_knots is 1.5"),
        (SDOF, {"n_knots": 3}, "n_knots is 3 in a window of 4 steps"),
        (SDOF, {"n_draws": float("nan")}, "n_draws is nan"),
        (SDOF, {"n_draws": 10**12}, "at most 10000"),
        (JOINT, {"n_draws": 10**12}, "at most 10000"),
        (SDOF, {"duration": 1e9}, "an episode of 1 environment takes 2.4 TB"),
        (SDOF, {"window": 1e9, "duration": 1e9}, "TB"),
        (SDOF, {"laws": 3}, "laws is 3"),
        (SDOF, {"shaping": 3}, "knots"),
        (DISCRIMINATION, {"pairs": ()}, "at least one name"),
        (SDOF, {"render_mode": "ansi"}, "rgb_array"),
    ],
)
def test_arguments_are_checked(identifier: str, arguments: dict[str, Any], message: str) -> None:
    cls = getattr(single, identifier.partition("/")[2].removesuffix("-v0") + "Env")
    with pytest.raises(BenchError, match=message):
        cls(**arguments)


def test_unknown_arguments_and_steps_before_reset_are_errors() -> None:
    with pytest.raises(TypeError, match="winow"):
        single.SDOFExcitationEnv(winow=0.1)
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        single.SDOFExcitationEnv().step(np.zeros(1, dtype=np.float32))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([np.nan], "entry 0 of the action.*nan"),
        ([-np.inf], "entry 0 of the action.*-inf"),
        ([0.1, 0.2], r"shape \(2,\) came; \(1,\) is expected"),
        ([[0.1]], r"shape \(1, 1\) came"),
        (0.1, r"shape \(\) came"),
        ([], r"shape \(0,\) came"),
        (["much"], "real numbers"),
        ([0.1j], "real numbers"),
        ([None], "real numbers"),
    ],
)
def test_an_action_that_is_none_is_refused_and_moves_nothing(action: Any, message: str) -> None:
    env, other = make(SDOF), make(SDOF)
    for each in (env, other):
        each.reset(seed=3)
    with pytest.raises(BenchError, match=message):
        env.step(action)
    np.testing.assert_array_equal(env.step(np.ones(1))[0], other.step(np.ones(1))[0])
