"""What shapes an excitation while it measures, on the rig of a file: planners and policies, as `jointbench excite` writes them."""

from __future__ import annotations

from typing import Any

CLOSED_LOOP = (
    "the force is shaped while measuring: this is what happens on the rig of the file. On a shaker, run it in closed loop "
    "(bench.excitation.Planner, PacedPlanner, find_policy); replayed open-loop on another rig it need not keep the limits"
)


def from_policy(asked: Any, name: str, rng: Any) -> tuple[Any, list[str]]:
    """What a policy does on the rig as it is described, and what the reader must know of it."""
    from bench.errors import ParameterError
    from bench.excitation import Ensemble, find_policy
    from bench.excitation.closed_loop import disturbances, run_policy

    policy, limits = find_policy(name), asked.experiment.limits
    station = policy.station
    if set(station.actuators) != set(limits.actuators) or asked.rig.timestep != station.timestep:
        raise ParameterError(
            f"policy '{name}' drives {', '.join(station.actuators)} every {station.timestep:g} s; this experiment drives "
            f"{', '.join(limits.actuators)} with a timestep of {asked.rig.timestep:g} s: set the timestep, or use --method dopt"
        )
    one = Ensemble((asked.rig,), station.channels, station.actuators)
    runs = run_policy(policy, one.packed, disturbances(station, 1, rng))
    columns = [station.actuators.index(actuator) for actuator in limits.actuators]
    controls = runs.records.controls[0][:, columns]
    made = _closed_loop(asked, f"policy '{name}'", controls)
    notes = [CLOSED_LOOP]
    if abs(asked.duration - station.duration) > 1e-9:
        notes.append(f"the policy's test lasts {station.duration:g} s, not {asked.duration:g} s")
    return made, notes


def from_planner(asked: Any, opening: Any, rng: Any) -> tuple[Any, list[str]]:
    """What the planner does on the rig as it is described, from an open-loop design."""
    from bench.excitation import Planner
    from bench.excitation.methods import controls_from

    controls = controls_from(opening)
    station = _station(asked, 1, len(controls))
    planner = Planner(asked.experiment.question, station, controls, background=asked.background)
    made, plans = _planned(asked, planner, rng)
    over = " over all backgrounds" if asked.background else ""
    notes = [
        f"at {plan.time:g} s: "
        + ", ".join(f"{name} {value:.4g}" for name, value in plan.values.items())
        + f"; expected error at the end {plan.predicted:.2g} prior standard deviations{over}"
        for plan in plans
    ]
    return made, [CLOSED_LOOP, *notes]


def from_paced(asked: Any, opening: Any, rng: Any) -> tuple[Any, list[str]]:
    """What the planner at the pace of the test does on the rig as it is described, from an open-loop design."""
    from bench.excitation import Ensemble, PacedPlanner
    from bench.excitation.closed_loop import disturbances, run_policy
    from bench.excitation.methods import controls_from

    controls = controls_from(opening)
    n_steps = _steps_a_window(len(controls), asked.band[1] * asked.experiment.timestep)
    station = _station(asked, n_steps, len(controls) // n_steps)
    planner = PacedPlanner(asked.experiment.question, station, controls, asked.background)
    one = Ensemble((asked.rig,), station.channels, station.actuators)
    tests = planner.memory(1)
    runs = run_policy(planner, one.packed, disturbances(station, 1, rng), memory=tests)
    made = _closed_loop(asked, "the paced planner", runs.records.controls[0])
    (test,) = tests
    return made, [CLOSED_LOOP, *_of_paced(planner, test, n_steps * station.timestep)]


def _of_paced(planner: Any, test: Any, window: float) -> list[str]:
    """What a paced planner knows at the end of a test."""
    notes = [f"decided every {window:g} s, {test.weighed} plans weighed in all"]
    kind = next(iter(test.follower.log_odds()), None)
    if kind is not None:
        family = planner.banks[kind].family
        values = zip(family.hypothesis.names, family.values(test.follower.found[kind].x), strict=True)
        notes.append("found at the end: " + ", ".join(f"{name} {value:.4g}" for name, value in values))
    if test.expected is not None:
        over = " over all backgrounds" if planner.background else ""
        notes.append(f"expected error at the end {test.expected:.2g} prior standard deviations{over}")
    return notes


def _steps_a_window(n: int, share: float) -> int:
    """Samples a window of a test of n: a divisor, for a knot every fifth of the band's shortest period at most.

    Args:
        n: Samples of the test.
        share: Of that period that a sample takes.
    """
    return max(k for k in range(1, n + 1) if n % k == 0 and (k == 1 or k * share <= 0.2))


def from_rival_planner(asked: Any, rng: Any) -> tuple[Any, list[str]]:
    """What the planner for rivals does on the rig as it is described, and how sure it is of that rig on the way."""
    from bench.excitation import RivalPlanner

    experiment = asked.experiment
    station = _station(asked, 1, round(asked.duration / experiment.timestep))
    planner = RivalPlanner(experiment.question, station, experiment.draws)
    made, plans = _planned(asked, planner, rng)
    notes = [
        f"at {plan.time:.2f} s: log Bayes factor in favour of the rig of the file {plan.log_odds:.1f} nat "
        "(certain with 99 % from 4.6 on)"
        for plan in plans[1:]
    ]
    return made, [CLOSED_LOOP, *notes]


def _station(asked: Any, n_steps: int, n_windows: int) -> Any:
    from bench.excitation import Station
    from bench.excitation.paced import SETTINGS

    experiment = asked.experiment
    wide = {name: SETTINGS.wide * deviation for name, deviation in experiment.noise.items()}
    scale = wide | experiment.limits.watched
    return Station(
        experiment.noise, scale, experiment.limits, experiment.timestep, n_steps, n_windows, asked.band
    )


def _planned(asked: Any, planner: Any, rng: Any) -> tuple[Any, list[Any]]:
    """What a planner does on the rig as it is described, and its plans."""
    from bench.excitation import Ensemble
    from bench.excitation.closed_loop import disturbances

    plans: list[Any] = []
    station = planner.station
    one = Ensemble((asked.rig,), station.channels, station.actuators)
    runs = planner.run(one.packed, disturbances(station, 1, rng), told=lambda _, plan: plans.append(plan))
    return _closed_loop(asked, "the planner", runs.records.controls[0]), plans


def _closed_loop(asked: Any, what: str, controls: Any) -> Any:
    """Commands of a closed loop as a design, held against the limits on the rig as it is described."""
    from bench.errors import ParameterError
    from bench.excitation import Design, Ensemble
    from bench.excitation.limits import peaks
    from bench.signals import Excitation
    from bench.signals.record import Record

    limits = asked.experiment.limits
    here = Ensemble((asked.rig,), tuple(limits.watched), limits.actuators)
    reached = peaks(here, limits, controls)
    over = [
        f"{kind} of {entry} ({100.0 * share:.0f} %)"
        for kind, entries in reached._asdict().items()
        for entry, share in entries.items()
        if share > 1.0 + 1e-9
    ]
    if over:
        raise ParameterError(
            f"{what} exceeds {', '.join(over)} on this rig, whose limits or parameters it was not made for; use --method dopt"
        )
    rate = 1.0 / asked.experiment.timestep
    signals = {actuator: Record(controls[:, i], rate) for i, actuator in enumerate(limits.actuators)}
    merit = float(asked.experiment.merit(controls[None])[0])
    return Design(what, Excitation(signals, len(controls) / rate, rate), merit, reached, 1)
