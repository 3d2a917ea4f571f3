"""The command that gives an engineer an excitation for a rig."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit, progress_bar

METHODS = {
    "dopt": "d_optimal",
    "multisine": "random_multisine",
    "schroeder": "schroeder",
    "crest": "crest_multisine",
    "sweep": "log_sweep",
    "prbs": "prbs",
    "planner": "",
    "policy": "",
}


CLOSED_LOOP = (
    "the force is shaped while measuring: this is what happens on the rig of the file. On a shaker, run it in closed loop "
    "(bench.excitation.Planner, find_policy); replayed open-loop on another rig it need not keep the limits"
)
NO_BACKGROUND = (
    "[[experiment.background]] is left out of account by this method; --method planner designs for it"
)


@dataclass
class Excite:
    """Design an excitation for a rig within its limits, to be taken to a shaker.

    The rig's file has a table [experiment]: what is unknown, measured and allowed (see docs/excitation.md). A planner or a policy
    shapes the force while it measures; what is written is what it does on the rig as the file describes it.
    """

    configuration: tyro.conf.Positional[Path]
    """Rig and experiment (TOML or JSON); or a verdict whose next test a planner can shape."""
    method: str = "dopt"
    """dopt (best open-loop one), multisine, schroeder, crest, sweep, prbs; or, shaped while measuring, planner or policy."""
    policy: str = ""
    """Trained policy by name or file (.npz), with --method policy."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("excitation.csv")
    """File: .csv (time and loads) or .json (an [excitation] for a rig's file)."""
    rrd: Path | None = None
    """Rerun recording of the episode to write: the rig in motion, its limits, and what is known by when."""
    draws: int = 8
    """Rigs drawn from what is unknown; the excitation keeps the limits on all of them."""
    evaluations: int = 1600
    """Signals that dopt weighs."""
    seed: int = 0
    """Seed."""
    force: bool = False
    """Overwrite a file that exists."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        import numpy as np

        from bench.documents import checked, naming
        from bench.errors import ParameterError
        from bench.excitation.request import request
        from bench.excitation.schema import ExcitationRequest

        self._check()
        document = checked(ExcitationRequest, _asked(self.configuration), str(self.configuration))
        with naming(str(self.configuration)):
            rig = document.build(self.configuration.parent)
        if document.experiment is None:
            raise ParameterError(
                f"{self.configuration} has no [experiment]; say what is unknown, measured and allowed (see docs/excitation.md)"
            )
        rng = np.random.default_rng(self.seed)
        asked = request(rig, document.experiment, draws=self.draws, rng=rng)
        with progress_bar(quiet=self.json) as show:
            made, notes = self._made(asked, rng, show)
            if self.rrd is not None:
                from bench.excitation.methods import controls_from
                from bench.rerun_log import log_episode

                show("writing the rerun recording", 1.0)
                title = f"excitation episode: {self.method}"
                log_episode(self.rrd, asked.rig, asked.experiment, controls_from(made), title=title)
        _write(self.out, made.excitation, rig)
        result = {
            "file": str(self.out),
            "rrd": None if self.rrd is None else str(self.rrd),
            "method": self.method,
            "policy": self.policy,
            "merit": made.merit,
            "peaks": made.peaks._asdict(),
            "duration": made.excitation.duration,
            "sample_rate": made.excitation.sample_rate,
            "notes": notes,
        }
        if self.json:
            emit(result)
        else:
            _tell(result)

    def _made(self, asked: Any, rng: Any, show: Any) -> tuple[Any, list[str]]:
        """What the method makes of what is asked, and what the reader must know of it."""
        from bench.excitation import Rivals, design

        unused = [NO_BACKGROUND] if asked.background else []
        if self.method == "policy":
            made, notes = _from_policy(asked, self.policy, rng)
            return made, [*notes, *unused]
        if self.method == "planner" and isinstance(asked.experiment.question, Rivals):
            show("planning", 0.0)
            return _from_rival_planner(asked, rng)
        made = design(
            METHODS[self.method] or "d_optimal",
            asked.experiment,
            duration=asked.duration,
            band=asked.band,
            rng=rng,
            evaluations=self.evaluations,
            progress=lambda n, merit: show(f"{n} signals, {merit:.2f} nat", n / self.evaluations),
        )
        if self.method != "planner":
            return made, unused
        show("planning", 1.0)
        return _from_planner(asked, made, rng)

    def _check(self) -> None:
        """Raise an error for arguments that do not go together."""
        from bench.errors import ParameterError, UnknownNameError
        from bench.targets import check_targets

        check_targets(self.out, self.rrd, force=self.force)
        if self.method not in METHODS:
            raise UnknownNameError("method", self.method, METHODS)
        if self.out.suffix not in {".csv", ".json"}:
            raise ParameterError(
                f"the excitation is to be written to '{self.out}'; a name ending in .csv or .json is expected"
            )
        if bool(self.policy) != (self.method == "policy"):
            raise ParameterError(
                "--policy NAME and --method policy go together; trained policies are listed by an unknown name"
            )


def _asked(path: Path) -> dict[str, Any]:
    """The document of a file: a rig with an experiment, or what a verdict asks of its next test."""
    from bench.documents.loading import load_document
    from bench.errors import ParameterError

    document = load_document(path)
    if "next_excitation" not in document:
        return document
    asked = (document["next_excitation"] or {}).get("closed_loop")
    if not asked:
        raise ParameterError(
            f"{path} is a verdict that asks for no test which a planner could shape; two force laws on the rig 'sdof' that the records "
            "cannot tell apart are expected"
        )
    return asked


def _tell(result: dict[str, Any]) -> None:
    table = Table(
        "limit",
        "of",
        "reached",
        title=f"{result['file']}: {result['duration']:g} s, {result['merit']:.1f} nat",
    )
    for limit, entries in result["peaks"].items():
        for name, share in entries.items():
            table.add_row(limit, name, f"{100.0 * share:.1f} %")
    Console().print(table)
    for note in result["notes"]:
        Console(stderr=True).print(f"note: {note}", style="yellow", markup=False, highlight=False)


def _from_policy(asked: Any, name: str, rng: Any) -> tuple[Any, list[str]]:
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


def _from_planner(asked: Any, opening: Any, rng: Any) -> tuple[Any, list[str]]:
    """What the planner does on the rig as it is described, from a D-optimal opening."""
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


def _from_rival_planner(asked: Any, rng: Any) -> tuple[Any, list[str]]:
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

    experiment = asked.experiment
    scale = dict.fromkeys(experiment.channels, 1.0) | experiment.limits.watched
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


def _write(path: Path, excitation: Any, rig: Any) -> None:
    import numpy as np

    from bench.files import json_values, replacing, write_text

    if path.suffix == ".json":
        write_text(path, json.dumps(json_values(excitation.to_dict()), ensure_ascii=False))
        return
    loads = excitation.sample()
    units = {channel.name: channel.unit for channel in rig.channels}
    names = [f"{name} [{units.get(name, '')}]" for name in excitation.signals]
    time = np.arange(len(loads)) / excitation.sample_rate
    with replacing(path) as temporary:
        np.savetxt(
            temporary, np.column_stack([time, loads]), delimiter=",", header=",".join(["time [s]", *names]),
            comments="", fmt="%.9g",
        )  # fmt: skip
