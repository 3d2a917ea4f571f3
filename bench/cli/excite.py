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
from bench.cli.excite_closed_loop import from_paced, from_planner, from_policy, from_rival_planner

METHODS = {
    "dopt": "d_optimal",
    "multisine": "random_multisine",
    "schroeder": "schroeder",
    "crest": "crest_multisine",
    "sweep": "log_sweep",
    "prbs": "prbs",
    "planner": "",
    "paced": "",
    "policy": "",
}


NO_BACKGROUND = "[[experiment.background]] is left out of account by this method; --method planner and paced design for it"


@dataclass
class Excite:
    """Design an excitation for a rig within its limits, to be taken to a shaker.

    The rig's file has a table [experiment]: what is unknown, measured and allowed (see docs/excitation.md). A planner or a policy
    shapes the force while it measures; what is written is what it does on the rig as the file describes it.
    """

    configuration: tyro.conf.Positional[Path]
    """Rig and experiment (TOML or JSON); or a verdict whose next test a planner can shape."""
    method: str = "dopt"
    """dopt (best open-loop one), multisine, schroeder, crest, sweep, prbs; or, shaped while measuring, planner, paced or policy."""
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
        from bench.errors import ParameterError
        from bench.excitation import Rivals, design

        unused = [NO_BACKGROUND] if asked.background else []
        if self.method == "policy":
            made, notes = from_policy(asked, self.policy, rng)
            return made, [*notes, *unused]
        rivals = isinstance(asked.experiment.question, Rivals)
        if self.method == "planner" and rivals:
            show("planning", 0.0)
            return from_rival_planner(asked, rng)
        if self.method == "paced" and rivals:
            raise ParameterError(
                "--method paced designs for the parameters of one explanation, and a rival came; take --method planner"
            )
        # a background spoils what a D-optimal opening tells
        opening = "crest_multisine" if asked.background else "d_optimal"
        made = design(
            METHODS[self.method] or opening,
            asked.experiment,
            duration=asked.duration,
            band=asked.band,
            rng=rng,
            evaluations=self.evaluations,
            progress=lambda n, merit: show(f"{n} signals, {merit:.2f} nat", n / self.evaluations),
        )
        if METHODS[self.method]:
            return made, unused
        show("planning", 1.0)
        return (from_planner if self.method == "planner" else from_paced)(asked, made, rng)

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
