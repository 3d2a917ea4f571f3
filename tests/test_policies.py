"""Policies, planner and the identification that they are judged by; training, and the command that hands out excitations."""

from __future__ import annotations

import importlib
import json
import pickle
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from bench.cli import main
from bench.errors import FileFormatError, ModelError, ParameterError, UnknownNameError
from bench.excitation import (
    Ensemble,
    Family,
    Planner,
    PlanPolicy,
    PlanStage,
    Policy,
    Recurrence,
    RigHypothesis,
    RivalPlanner,
    Rivals,
    Station,
    Uncertain,
    estimate,
    fans,
    find_policy,
    policy_names,
)
from bench.excitation.background import errors_left, with_background
from bench.excitation.closed_loop import disturbances, run_commands, run_policy
from bench.excitation.estimation import costs, normal_equations
from bench.excitation.information import (
    INFORMATION_LIMITS,
)
from bench.signals import Excitation
from envs.background import background_of
from envs.options import Options
from envs.practice import (
    PRACTICE_SETTINGS,
    PracticeBenches,
)
from envs.setups import discrimination_setup, sdof_setup

SETUP = sdof_setup()
STATION = SETUP.station()
NOISE = np.array(list(SETUP.noise.values()))
GAP, BOUC_WEN, COULOMB = (
    Family(h, STATION.channels, STATION.actuators) for h in SETUP.questions[0].hypotheses
)  # type: ignore[union-attr]
EXAMPLE = Path(__file__).parent.parent / "examples" / "excite.toml"


def some(family: Family, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.6, 1.6, (n, family.n_parameters))


def sweep() -> np.ndarray:
    """Through all resonances of the prior, upwards."""
    frequency = np.linspace(1.2, 2.6, STATION.n_samples)
    return 1.2 * np.sin(2.0 * np.pi * np.cumsum(frequency) * STATION.timestep)[:, None]


def small_policy(seed: int = 0, station: Station = STATION) -> Policy:
    rng = np.random.default_rng(seed)
    widths = [21, 7, 1]
    return Policy(
        "small",
        tuple(rng.standard_normal((b, a)) / np.sqrt(a) for a, b in pairwise(widths)),
        tuple(0.1 * rng.standard_normal(b) for b in widths[1:]),
        np.zeros(21),
        np.ones(21),
        0.3 * rng.standard_normal((1, station.n_windows, 1)),
        station,
    )


def remembering_policy(units: int = 3) -> Policy:
    """A small policy behind a memory of three units."""
    policy, rng = small_policy(), np.random.default_rng(1)
    arrays = [
        rng.standard_normal(shape) / 3.0 for shape in ((4 * units, 21), (4 * units, units), (4 * units,))
    ]
    first = rng.standard_normal((7, units))
    return replace(policy, weights=(first, policy.weights[1]), recurrence=Recurrence(*arrays))


def planning_policy() -> PlanPolicy:
    """Takes the second of two plans where the first displacement of the third window is above zero, the first where it is below."""
    entries = 13  # four samples of three channels, and the command
    weight = np.zeros((3, 3 * entries))
    weight[1, 2 * entries], weight[2, 2 * entries] = 1.0, -1.0
    ones = np.ones(3 * entries)
    rest = np.ones((STATION.n_windows - 3, 1))
    stage = PlanStage(3, np.stack([-0.5 * rest, 0.5 * rest]), 0.0 * ones, ones, (weight,), (np.zeros(3),))
    return PlanPolicy("planning", STATION, np.full((STATION.n_windows, 1), 0.1), (stage,))


@pytest.mark.parametrize("family", [GAP, BOUC_WEN, COULOMB], ids=lambda f: f.hypothesis.name)
def test_families_are_the_ensembles_of_their_rigs(family: Family) -> None:
    x = some(family, 5)
    rigs = tuple(family.hypothesis.at(row).rig for row in x)
    other = Ensemble(rigs, STATION.channels, STATION.actuators).record(sweep()[None])
    # The same loop on coefficients that were interpolated instead of probed: rounding, and eight seconds of it.
    np.testing.assert_allclose(family.record(x[None], sweep()[None]), other, rtol=0, atol=1e-9)


def test_what_is_not_affine_is_no_family() -> None:
    heavy = RigHypothesis("heavy", GAP.hypothesis.rig, (Uncertain("mass:carriage", 1.0, 4.0),))
    with pytest.raises(ModelError, match="masses and inertias"):
        Family(heavy, STATION.channels, STATION.actuators)


@pytest.mark.slow
@pytest.mark.parametrize("family", [GAP, BOUC_WEN, COULOMB], ids=lambda f: f.hypothesis.name)
def test_identification_finds_the_rigs_it_was_not_told(family: Family) -> None:
    x = some(family, 12, seed=1)
    runs = run_commands(
        STATION, sweep(), family.packed(x), disturbances(STATION, 12, np.random.default_rng(2))
    )
    found = estimate(family, runs.records, NOISE)
    # Nothing is more probable than what was found, the truth included; on lightly damped rigs that beat against a dead-space a
    # search in twelve ends in a worse valley, for which comparisons take interquartile means.
    lead = costs(family, runs.records, x[:, None], NOISE)[:, 0] - found.cost
    good = lead > -1e-3
    assert np.sum(good) >= 10
    # Twice the log likelihood ratio of optimum and truth: chi-squared with p degrees of freedom, less what the prior holds back;
    # the mean of ten lies within 4 sigma of p. Unlike a distance, it does not mind the curved valleys of Bouc-Wen joints.
    p = family.n_parameters
    assert np.mean(lead[good]) < p + 4.0 * np.sqrt(2.0 * p / 10.0)


def test_closed_loop_is_that_of_the_environment_in_mujoco() -> None:
    policy = small_policy()
    env = gymnasium.make("JointBench/SDOFExcitation-v0", enforcement="cost").unwrapped
    observation, _ = env.reset(seed=3)
    truth = env.truth  # type: ignore[attr-defined]
    family = next(f for f in (GAP, BOUC_WEN, COULOMB) if f.hypothesis.name == truth.hypothesis.name)
    noise = NOISE * env.benches._disturbance  # type: ignore[attr-defined]
    actions = []
    for _ in range(60):
        actions.append(policy.act(observation))
        observation, *_ = env.step(actions[-1])
    runs = run_policy(policy, family.packed(truth.coordinates[None]), noise)
    shaped = runs.records.controls[0, : 60 * 4 : 4, 0]  # the first step after each knot
    again = STATION.limits.force["shaker"] * np.array(actions)[:, 0]
    np.testing.assert_allclose(runs.records.controls[0, 3 : 60 * 4 : 4, 0], again, atol=1e-5)  # float32
    assert np.std(shaped) > 0.05
    assert runs.records.controls.shape == (1, 800, 1)


def test_practice_rewards_what_the_record_tells_of_the_rig() -> None:
    policy, n = small_policy(), 6
    benches = PracticeBenches(SETUP, Options(enforcement="cost", penalty=0.0), n)
    places = np.arange(n)
    observation = benches.reset(places, [np.random.default_rng(i) for i in range(n)])
    total = np.zeros(n)
    for _ in range(50):
        outcome = benches.step(places, policy.act(observation))
        observation = outcome.observation
        total += outcome.reward
    for i, family in ((0, GAP), (4, BOUC_WEN)):
        draw = benches.truth[i]
        assert draw is not None
        assert draw.hypothesis is family.hypothesis
    runs = run_policy(policy, GAP.packed(benches.truth[0].coordinates[None]), benches._disturbance[:1])  # type: ignore[union-attr]
    u = runs.records.controls[0, :200]
    y = GAP.record(fans(benches.truth[0].coordinates[None], INFORMATION_LIMITS.step), u[None])[0]  # type: ignore[union-attr]
    rows = ((y[1:] - y[0]) / INFORMATION_LIMITS.step / NOISE).reshape(4, -1)
    remaining = np.trace(np.linalg.inv(np.eye(4) + rows @ rows.T)) / 4.0
    assert total[0] == pytest.approx(-4.0 * np.log(remaining + PRACTICE_SETTINGS.floor**2), rel=1e-6)


@pytest.mark.parametrize(
    "policy",
    [small_policy(), remembering_policy(), planning_policy()],
    ids=["no memory", "memory", "plans"],
)
def test_policies_travel(policy: Policy | PlanPolicy, tmp_path: Path) -> None:
    policy.save(tmp_path / "small.npz")
    observation = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 21)).astype(np.float32)
    for other in (find_policy(str(tmp_path / "small.npz")), pickle.loads(pickle.dumps(policy))):
        theirs, ours = other.memory(5), policy.memory(5)
        for _ in range(5):
            np.testing.assert_array_equal(other.act(observation, theirs), policy.act(observation, ours))
        assert other.station == policy.station


def test_a_memory_tells_records_apart_that_end_in_the_same_window() -> None:
    policy, rng = remembering_policy(), np.random.default_rng(2)
    first, last = rng.uniform(-1.0, 1.0, (2, 4, 21)).astype(np.float32)
    memory = policy.memory(4)
    policy.act(first, memory)
    after = policy.act(last, memory)
    assert np.abs(after - policy.act(last, policy.memory(4))).min() > 1e-3
    one = policy.memory()  # a single test, as on a shaker
    policy.act(first[2], one)
    np.testing.assert_allclose(policy.act(last[2], one), after[2], atol=1e-6)
    for wrong in (None, policy.memory(3)):
        with pytest.raises(ParameterError, match=r"memory = policy\.memory"):
            policy.act(last, wrong)
    short = Recurrence(np.zeros((12, 20)), np.zeros((12, 3)), np.zeros(12))
    with pytest.raises(ParameterError, match="takes 20 observations; 21"):
        replace(policy, recurrence=short)
    with pytest.raises(ParameterError, match="are expected"):
        Recurrence(np.zeros((12, 21)), np.zeros((12, 4)), np.zeros(12))


def test_a_policy_of_plans_takes_the_plan_of_least_expected_error() -> None:
    policy = planning_policy()
    observation = np.zeros(
        (6, 3, 21), dtype=np.float32
    )  # windows of three tests; the first shows the rest before
    observation[3, :, 0] = 0.2, -0.2, 0.0  # what the third window shows, seen by the fourth decision
    memory, one = policy.memory(3), policy.memory()
    acted = [policy.act(row, memory) for row in observation]
    np.testing.assert_allclose(acted[2], 0.1)
    np.testing.assert_allclose(acted[3][:, 0], [0.5, -0.5, 0.1])
    np.testing.assert_allclose(acted[5], acted[3])  # and stays there
    np.testing.assert_array_equal([policy.act(row[1], one) for row in observation], [a[1] for a in acted])
    with pytest.raises(ParameterError, match=r"memory = policy\.memory"):
        policy.act(observation[0])
    with pytest.raises(ParameterError, match="length 21"):
        policy.act(observation[0, :, :20], policy.memory(3))
    over = policy.memory(3)
    over.seen = STATION.n_windows
    with pytest.raises(ParameterError, match="begin anew"):
        policy.act(observation[0], over)
    with pytest.raises(ParameterError, match="decides after 3 windows"):
        replace(policy, stages=(policy.stages[0], policy.stages[0]))
    with pytest.raises(ParameterError, match="an opening of shape"):
        replace(policy, opening=policy.opening[1:])
    with pytest.raises(ParameterError, match="3 outputs"):
        replace(policy.stages[0], weights=(np.zeros((2, 39)),), biases=(np.zeros(2),))


def test_archives_of_plans_that_lack_something_are_refused(tmp_path: Path) -> None:
    policy = planning_policy()
    policy.save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as whole:
        arrays = dict(whole)
    del arrays["mean_0"]
    np.savez(tmp_path / "part.npz", **arrays)
    with pytest.raises(FileFormatError, match="mean_0"):
        find_policy(str(tmp_path / "part.npz"))
    stage = policy.stages[0]
    for odd, said in (
        ({"mean": np.float32(1.0)}, "mean of another number"),
        ({"weights": ()}, "0 weights"),
        ({"deviation": -stage.deviation}, "not positive"),
        ({"weights": (1e38 * np.ones_like(stage.weights[0]),)}, "too large"),
        ({"biases": (np.full(3, np.nan),)}, "NaN"),
    ):
        with pytest.raises(ParameterError, match=said):
            replace(stage, **odd)


@pytest.mark.slow
def test_plans_are_tried_on_rigs_as_the_policy_leaves_them_and_training_goes_on(tmp_path: Path) -> None:
    from envs.plan_training import train_plans
    from envs.training_plan import PlanTraining

    training = PlanTraining(plans=4, rigs=6, backgrounds=0.5, evaluations=8, generations=2, steps=40)
    policy = train_plans(training, tmp_path)
    assert [stage.window for stage in policy.stages] == [40, 80]
    assert policy.about["environment"] == "JointBench/SDOFExcitation-v0"
    with np.load(tmp_path / "tried-1.npz") as kept:
        # of the rigs with Coulomb friction those without a background
        values, plans = kept["values"][12:18:2], kept["plans"]
    assert plans.shape == (4, 120, 1)
    # the first choice is to go on: what is left then is what the record of the policy with one decision leaves
    first = replace(policy, stages=policy.stages[:1])
    rng = np.random.default_rng((0, 1, 3))
    b, bound = len(background_of(SETUP)), np.sqrt(3.0)
    drawn = [rng.uniform(-bound, bound, (6, f.n_parameters + b)) for f in (GAP, BOUC_WEN, COULOMB)]
    x = drawn[2][::2, : COULOMB.n_parameters]
    noise = disturbances(STATION, 6, np.random.default_rng((0, 1, 4, 2)))[::2]
    runs = run_policy(first, COULOMB.packed(x), noise)
    information, _ = normal_equations(COULOMB, runs.records, x, NOISE)
    left = np.sqrt(np.trace(np.linalg.inv(np.eye(3) + information), axis1=1, axis2=2) / 3.0)
    within = runs.reached.max(axis=1) < 0.9
    assert within.any()
    # differences over a hundredth of the prior's standard deviation against a ten-thousandth
    np.testing.assert_allclose(np.exp(values[within, 0]), left[within], rtol=0.1)
    again = train_plans(training, tmp_path)
    np.testing.assert_array_equal(again.stages[1].weights[0], policy.stages[1].weights[0])
    with pytest.raises(FileFormatError, match="another folder"):
        train_plans(replace(training, plans=5), tmp_path)
    with pytest.raises(ParameterError, match="a share of 1"):
        replace(training, backgrounds=1.5)
    with pytest.raises(ParameterError, match="tried on no rig"):
        train_plans(replace(training, plans=40, rigs=2, tried=1), tmp_path / "few")


def test_policies_say_what_they_cannot_take(tmp_path: Path) -> None:
    policy = small_policy()
    observation = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 21)).astype(np.float32)
    with pytest.raises(ParameterError, match="length 21"):
        policy.act(observation[:, :20])
    with pytest.raises(UnknownNameError, match="policy"):
        find_policy("nothing")
    (tmp_path / "no.npz").write_bytes(b"no archive")
    with pytest.raises(FileFormatError, match="is no policy"):
        find_policy(str(tmp_path / "no.npz"))
    with pytest.raises(ParameterError, match="schedule"):
        replace(policy, schedule=np.zeros((1, 3, 1)))
    with pytest.raises(ValueError, match="read-only"):
        policy.weights[0][0, 0] = 1.0


@pytest.mark.parametrize("name", policy_names())
def test_shipped_policies_keep_the_limits_of_their_station(name: str) -> None:
    policy = find_policy(name)
    env = gymnasium.make(policy.about["environment"], **policy.about["arguments"]).unwrapped
    violations = steps = 0
    for seed in range(4):
        observation, _ = env.reset(seed=910 + seed)
        done, memory = False, policy.memory()
        while not done:
            observation, _, terminated, truncated, info = env.step(policy.act(observation, memory))
            violations, steps, done = violations + info["violation"], steps + 1, terminated or truncated
    # the aim over all rigs, which scripts/evaluate_excitation.py measures
    assert violations <= 0.0075 * steps
    assert steps > 100


@pytest.mark.slow
def test_planning_knows_more_than_its_opening_and_keeps_the_limits() -> None:
    x = some(BOUC_WEN, 3, seed=4)
    noise = disturbances(STATION, 3, np.random.default_rng(5))
    plans = []
    planner = Planner(SETUP.questions[0], STATION, 0.7 * sweep(), (0.375,), generations=5)  # type: ignore[arg-type]
    runs = planner.run(BOUC_WEN.packed(x), noise, told=lambda place, plan: plans.append((place, plan)))
    opening = run_commands(STATION, 0.7 * sweep(), BOUC_WEN.packed(x), noise)
    np.testing.assert_array_equal(runs.records.controls[:, :300], opening.records.controls[:, :300])
    errors = []
    for item in (runs, opening):
        information, _ = normal_equations(BOUC_WEN, item.records, x, NOISE)
        errors.append(np.trace(np.linalg.inv(np.eye(5) + information), axis1=1, axis2=2))
    assert np.mean(np.log(errors[0])) < np.mean(np.log(errors[1])) - 0.1  # found: 0.5 and more
    assert np.max(runs.reached) <= 1.0
    assert np.max(runs.energy) <= 1.0 + 1e-9
    assert [place for place, _ in plans] == [0, 1, 2]
    again = planner.run(BOUC_WEN.packed(x), noise)
    np.testing.assert_array_equal(again.records.controls, runs.records.controls)


@pytest.mark.slow
def test_planning_for_rigs_with_a_background_leaves_less_error_there() -> None:
    terms, x = background_of(SETUP), some(COULOMB, 3, seed=4)
    real = Family(with_background(COULOMB.hypothesis, terms), STATION.channels, STATION.actuators)
    left = []
    for background in ((), terms):
        planner = Planner(SETUP.questions[0], STATION, 0.7 * sweep(), (0.375,), 5, background)  # type: ignore[arg-type]
        rests = [planner.continuation(2, row, 0.7 * sweep(), 300, 1) for row in x]
        whole = np.tile(0.7 * sweep(), (3, 1, 1))
        whole[:, 300:] = rests
        left.append(
            [errors_left(real, row, u[None], NOISE).backed[0] for row, u in zip(x, whole, strict=True)]
        )
    assert np.all(np.less_equal(left[1], left[0]))
    assert np.mean(np.log(left[1])) < np.mean(np.log(left[0])) - 0.1  # found: half the error of two of three


@pytest.mark.slow
def test_planning_tells_rivals_apart_within_the_limits_and_from_what_is_measured_only() -> None:
    setup = discrimination_setup("sdof", ("gap_cubic",))
    asked, station = setup.questions[0], setup.station(n_windows=30)
    assert isinstance(asked, Rivals)
    family = Family(asked.first, station.channels, station.actuators)
    x = np.array([[0.3, -0.5, 0.4, -0.2], [-0.4, 0.2, -0.5, 0.5]])
    noise = disturbances(station, 2, np.random.default_rng(5))
    plans: list[tuple] = []
    planner = RivalPlanner(asked, station, setup.experiments[0].draws, generations=4)  # type: ignore[arg-type]
    runs = planner.run(family.packed(x), noise, told=lambda place, plan: plans.append((place, plan)))
    assert np.max(runs.reached) <= 1.0
    assert np.max(runs.energy) <= 1.0 + 1e-9
    np.testing.assert_array_equal(
        runs.records.controls[0, :10], runs.records.controls[1, :10]
    )  # nothing known
    assert np.any(runs.records.controls[0, 10:] != runs.records.controls[1, 10:])
    for place in range(2):  # certain of the truth, soon
        known = [plan for i, plan in plans if i == place and plan.log_odds > np.log(99.0)]
        assert known[0].time <= 1.0  # found: 0.5 and 0.6 s
    alone = planner.run(family.packed(x[:1]), noise[:1])
    np.testing.assert_array_equal(alone.records.controls[0], runs.records.controls[0])


def test_rival_planners_say_what_they_cannot_take() -> None:
    setup = discrimination_setup("sdof", ("gap_cubic",))
    draws = setup.experiments[0].draws
    for arguments in ({"interval": 5.0}, {"knot": 0.01}, {"generations": 0}):
        with pytest.raises(ParameterError, match="timestep"):
            RivalPlanner(setup.questions[0], setup.station(), draws, **arguments)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="pairs"):
        RivalPlanner(setup.questions[0], setup.station(), ())  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(("algorithm", "memory"), [("ppo", 0), ("sac", 0), ("ppo", 6)])
def test_exported_policies_are_the_trained_networks(algorithm: str, memory: int, tmp_path: Path) -> None:
    import torch

    from envs.training import Trainer
    from envs.training_plan import TrainingPlan

    plan = TrainingPlan(
        algorithm=algorithm, n_envs=3, network=(8, 5), memory=memory, start="nothing", n_held_out=3
    )
    trainer = Trainer(plan, tmp_path)
    with torch.no_grad():  # networks begin with outputs of nearly zero
        for parameter in trainer.model.policy.parameters():
            parameter.add_(0.3 * torch.randn(parameter.shape))
    trainer.env.reset()
    for _ in range(5):
        trainer.env.step(np.ones((3, 1), dtype=np.float32))  # for statistics of observations
    policy = trainer.policy()
    state, kept = None, policy.memory(40)
    for observation in np.random.default_rng(0).uniform(-1.0, 1.0, (3, 40, 21)).astype(np.float32):
        seen = np.asarray(trainer.env.normalize_obs(observation))
        mean, state = trainer.model.predict(seen, state, deterministic=True)
        wanted = np.clip(mean + STATION.scheduled(observation, policy.schedule), -1.0, 1.0)
        # float32 in two orders of summation
        np.testing.assert_allclose(policy.act(observation, kept), wanted, atol=1e-5)
    assert np.std(wanted) > 0.1


@pytest.mark.slow
def test_a_memory_learns_to_imitate_whole_tests(tmp_path: Path) -> None:
    from envs.training import Trainer, evaluate
    from envs.training_plan import TrainingPlan

    found = {}
    for start in ("nothing", "pump"):
        plan = TrainingPlan(n_envs=24, network=(16,), memory=16, start=start, n_held_out=24)
        found[start] = evaluate(Trainer(plan, tmp_path / start).policy(), "sdof", n=24).score
    assert found["pump"] > found["nothing"] + 10.0  # found: 21 and 0 nat


@pytest.mark.slow
def test_a_smoke_training_improves_on_its_start_and_goes_on_where_it_was(tmp_path: Path) -> None:
    from envs.training import Trainer
    from envs.training_plan import TrainingPlan

    plan = TrainingPlan(
        steps=24_000, n_envs=48, network=(16,), start="nothing", evaluate_every=9_600, n_held_out=24
    )
    trainer = Trainer(plan, tmp_path)
    trainer.run()
    first, last = trainer.curve[0], trainer.curve[-1]
    # On the same 24 rigs with the same noise: what learned nothing stays at 0.1 nat; found: 1.7 nat.
    assert last.score > first.score + 0.5
    steps = trainer.model.num_timesteps
    longer = Trainer(replace(plan, steps=steps + 9_600), tmp_path)
    assert [row.steps for row in longer.curve] == [row.steps for row in trainer.curve]
    longer.run()
    assert longer.model.num_timesteps > steps
    assert longer.curve[-1].seconds > last.seconds
    with pytest.raises(FileFormatError, match="another plan"):
        Trainer(replace(plan, seed=5), tmp_path)


@pytest.mark.slow
def test_evaluation_compares_on_the_same_rigs_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent / "scripts"))
    evaluation = importlib.import_module("evaluate_excitation")
    monkeypatch.setattr(evaluation, "RESAMPLES", 100)
    command = [
        "evaluate_excitation", "sdof", "--methods", "log_sweep", "prbs", "--no-planner", "--seeds", "2", "--rigs", "1",
        "--workers", "1", "-o", str(tmp_path), "--json", "-",
    ]  # fmt: skip
    monkeypatch.setattr(sys, "argv", command)
    assert evaluation.main() == 0
    document = json.loads(capsys.readouterr().out)
    assert set(document["all"]) == {"log_sweep", "prbs", "policy sdof"}
    row = document["all"]["policy sdof"]
    assert row["rigs"] == 2
    assert row["best_baseline"] in {"log_sweep", "prbs"}
    assert row["ratio"] == pytest.approx(row["middle"] / document["all"][row["best_baseline"]]["middle"])
    assert row["interval"][0] <= row["middle"] <= row["interval"][1]
    kept = sorted((tmp_path / "sdof").glob("*.json"))
    stamps = [path.stat().st_mtime_ns for path in kept[1:]]
    kept[0].unlink()
    assert evaluation.main() == 0
    assert json.loads(capsys.readouterr().out) == document
    assert [path.stat().st_mtime_ns for path in kept[1:]] == stamps  # only what was missing was made again


def test_excite_writes_a_feasible_excitation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "excitation.csv"
    assert main(["excite", str(EXAMPLE), "--method", "sweep", "-o", str(out), "--draws", "3", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    shares = [share for entries in told["peaks"].values() for share in entries.values()]
    assert max(shares) == pytest.approx(1.0, abs=1e-3)  # as large as the limits allow, and no larger
    assert max(shares) <= 1.0 + 1e-9
    header, *rows = out.read_text().splitlines()
    assert header == "time [s],shaker [N]"
    assert len(rows) == 800
    time, force = np.loadtxt(out, delimiter=",", skiprows=1).T
    assert time[-1] == pytest.approx(7.99)
    assert np.max(np.abs(force)) == pytest.approx(2.0 * told["peaks"]["force"]["shaker"], rel=1e-6)
    again = tmp_path / "excitation.json"
    assert (
        main(["excite", str(EXAMPLE), "--method", "sweep", "-o", str(again), "--draws", "3", "--json"]) == 0
    )
    signal = Excitation.from_dict(json.loads(again.read_text())).sample()
    np.testing.assert_allclose(signal[:, 0], force, atol=1e-8)


@pytest.mark.slow
def test_excite_by_a_policy_and_by_planning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "small.npz"
    small_policy().save(path)
    out = str(tmp_path / "e.csv")
    assert (
        main(["excite", str(EXAMPLE), "--method", "policy", "--policy", str(path), "-o", out, "--json"]) == 0
    )
    assert json.loads(capsys.readouterr().out)["peaks"]["stroke"]["displacement"] < 1.0
    arguments = ["--method", "planner", "--evaluations", "64", "--draws", "2", "-o", out, "--force", "--json"]
    assert main(["excite", str(EXAMPLE), *arguments]) == 0
    told = json.loads(capsys.readouterr().out)
    assert any("gap.clearance" in note for note in told["notes"])
    assert max(share for entries in told["peaks"].values() for share in entries.values()) <= 1.0 + 1e-9


BACKGROUND = """
[[experiment.background]]
law = "cubic_stiffness"
joint = "carriage"
parameter = "k3"
deviation = 3e4
"""


@pytest.mark.slow
def test_excite_designs_for_a_background_by_planning_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "asked.toml"
    path.write_text(EXAMPLE.read_text() + BACKGROUND)
    rest = ["--evaluations", "64", "--draws", "2", "-o", str(tmp_path / "e.csv"), "--force", "--json"]
    told = {}
    for name, method in (("planned", "planner"), ("open", "dopt"), ("unasked", "planner")):
        assert main(["excite", str(EXAMPLE if name == "unasked" else path), "--method", method, *rest]) == 0
        told[name] = json.loads(capsys.readouterr().out)["notes"]
    assert "prior standard deviations over all backgrounds" in told["planned"][-1]
    assert told["open"] == [
        "[[experiment.background]] is left out of account by this method; --method planner and paced design for it"
    ]
    assert not any("background" in note for note in told["unasked"])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (("cubic_stiffness", "cubic_stifness"), "Did you mean 'cubic_stiffness'"),
        (("k3", "k2"), "known: k3"),
        (('"carriage"', '"cariage"'), "Did you mean 'carriage'"),
        (("3e4", "-3e4"), "deviation"),
    ],
)
def test_a_background_that_no_rig_has_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changed: tuple[str, str], said: str
) -> None:
    path = tmp_path / "asked.toml"
    path.write_text(EXAMPLE.read_text() + BACKGROUND.replace(*changed))
    assert main(["excite", str(path), "-o", str(tmp_path / "e.csv")]) == 2
    assert said in capsys.readouterr().err.replace("\n", " ")


def test_a_background_beside_a_rival_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "asked.toml"
    path.write_text(EXAMPLE.read_text() + BACKGROUND + RIVAL)
    assert main(["excite", str(path), "-o", str(tmp_path / "e.csv")]) == 2
    assert "it came with a rival" in capsys.readouterr().err


RIVAL = """
[experiment.rival]
elements = [{ law = "cubic_stiffness", joints = ["carriage"], name = "cubic", parameters = { k3 = 3e5 } }]
uncertain = { "cubic.k3" = [5e4, 2e6] }
"""


@pytest.mark.slow
def test_excite_between_rivals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "rig.toml", str(tmp_path / "e.csv")
    path.write_text(EXAMPLE.read_text().replace("duration = 8.0", "duration = 1.2") + RIVAL)
    merits = {}
    for method in ("sweep", "planner"):
        assert (
            main(["excite", str(path), "--method", method, "--draws", "4", "-o", out, "--force", "--json"])
            == 0
        )
        told = json.loads(capsys.readouterr().out)
        merits[method] = told["merit"]
        assert max(share for entries in told["peaks"].values() for share in entries.values()) <= 1.0 + 1e-9
    assert any("log Bayes factor" in note for note in told["notes"])
    assert merits["planner"] > merits["sweep"]
    path.write_text(path.read_text().replace('uncertain = { "cubic', 'unknown = { "cubic'))
    assert main(["excite", str(path), "-o", out, "--force"]) == 2
    assert "entry of a rival" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("change", "arguments", "message"),
    [
        ({}, ["--method", "dop"], "Did you mean 'dopt'"),
        ({}, ["--method", "policy"], "go together"),
        ({}, ["-o", "excitation.wav"], "ending in .csv or .json"),
        ({"force = { shaker": "force = { shake"}, [], "actuator"),
        ({"duration = 8.0": "length = 8.0"}, [], "duration"),
        ({'"gap.clearance"': '"gap.width"'}, [], "width"),
        ({"band = [0.5, 5.0]": "band = [0.5, 80.0]"}, ["--method", "sweep"], "half the step rate"),
        (
            {"[experiment]": "[experimnet]", "[experiment.uncertain]": "[experimnet.uncertain]"},
            [],
            "Did you mean 'experiment'",
        ),
    ],
)
def test_excite_says_what_is_wrong(
    change: dict[str, str],
    arguments: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = EXAMPLE.read_text()
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    assert main(["excite", str(path), *arguments]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert message in told
    assert "Traceback" not in told
