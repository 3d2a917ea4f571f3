"""The diagnosis by command: of a case folder, of logs against a model, of a fleet of cases."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from bench.cli.console import emit
from bench.cli.paths import PRINTED
from bench.cli.records import pairs
from bench.cli.verdict_text import verdict_summary

if TYPE_CHECKING:
    from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
    from bench.discrepancy.case.case import Case
    from bench.discrepancy.diagnosis import Diagnosis
    from bench.discrepancy.report.answers import Files


@dataclass
class Diagnose:
    """Say where a simulation misses the measurement, which effect causes it, and how far the gap shrinks once it is added.

    Examples:
      jointbench diagnose my-case --html report.html --json verdict.json
      jointbench diagnose run_1.csv run_2.csv arm.xml --map q1=shoulder.position u1=shoulder.command --json verdict.json
      jointbench diagnose robot_1 robot_2 robot_3 --html fleet.html --json fleet.json
    """

    cases: tyro.conf.Positional[tuple[Path, ...]]
    """A case folder (nominal.json and records, docs/howto-mismatch.md); several, for a fleet; or logs and an MJCF, the last log judging."""
    map: tuple[str, ...] = ()
    """Of logs: what columns stand for: COLUMN=JOINT.position (velocity, acceleration, torque, command), =ACTUATOR, =SENSOR, =- for none."""
    unit: tuple[str, ...] = ()
    """Of logs: units that headings do not tell, COLUMN=UNIT."""
    judge: tuple[Path, ...] = ()
    """Of logs: those that judge; the last one by default, of a single log its last third."""
    rate: float = 0.0
    """Of logs: sample rate [Hz] where they have no time."""
    assume: tuple[str, ...] = ()
    """Of logs: how well numbers of the model are known, KIND=SHARE or KIND=FACTOR (mass, stiffness, damping, frictionloss, armature,
    kp, kv, forcerange; twins, by how much drives of one type differ): kp=0.1 to ten percent, kp=10, the default, to a factor of ten."""
    scheduler: str = ""
    """Of a fleet: address of a dask scheduler (extra scale) that its cases run on."""
    json: Path | None = None
    """File for the result as JSON; "-", or nothing at the end, prints it."""
    html: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File for the report, a self-contained HTML page."""
    rrd: Path | None = None
    """File for a rerun recording: measured and simulated channels, and where the gap lies."""
    next_test: Path | None = None
    """Of an arm: file (CSV) for joint trajectories that would tell what is named from its closest rival; written where there is one."""
    exclude: tuple[str, ...] = ()
    """Effects to leave out of the catalogue."""
    most: int = 3
    """Largest number of effects named together; of a robot, at one joint."""
    anyway: bool = False
    """Go on where a unit, a sign or a part of the model stands against the diagnosis; what it was becomes a note."""
    budget: float | None = None
    """Seconds after which no further stage of the search is begun; the verdict is then the best one so far and says what was not tried.
    Those of the settings where none are given, ten minutes; inf for no end."""
    check: bool = True
    """Look at the records first, as `jointbench check` does, and say at once what is doubtful."""
    settings: Path | None = None
    """File (JSON or TOML) with thresholds that differ from their defaults, as tables by room (see docs/thresholds.md)."""
    force: bool = False
    """Overwrite files that exist."""
    progress: bool = True
    """Show what is being done, on standard error."""

    def __call__(self) -> None:
        """Run the command."""
        self._check_places()
        from bench.errors import ParameterError

        logs = [path for path in self.cases if not path.is_dir()]
        model = [path for path in logs if path.suffix == ".xml"]
        if model and len(logs) == len(self.cases):
            self._of_logs([path for path in logs if path not in model], model)
        elif self.cases and not logs and (stated := self._of_logs_alone()):
            raise ParameterError(
                f"{', '.join(stated)} came with a case folder, whose nominal.json says that; leave it out, or give logs and an MJCF"
            )
        elif len(self.cases) == 1:
            from bench.discrepancy import read_case
            from bench.discrepancy.report.answers import Files

            with _stages(self.progress) as stage:
                case = read_case(self.cases[0])
                found = _diagnosed(self, case, stage)
                files = Files.of(case, self._verdict)
                document, written, problem = self._results(found, stage, (), files)
            self._told(found, document, written, problem, files)
        elif self.cases and not logs:
            from bench.cli.fleet import diagnose_fleet

            diagnose_fleet(self, _stages)
        else:
            raise ParameterError(
                "give one case folder, several (a fleet), or logs and the MJCF they are held against, as in: "
                "jointbench diagnose run.csv model.xml"
            )

    def _draft(self, logs: Sequence[Path], model: str) -> str:
        """The command that keeps the case of some logs in the folder ``case``."""
        said: dict[str, Sequence[object]] = {
            "--map": self.map, "--unit": self.unit, "--judge": self.judge, "--assume": self.assume,
            "--rate": (self.rate,) if self.rate else (),
        }  # fmt: skip
        options = [
            text
            for name, values in said.items()
            if values
            for text in (name, *(quote(str(v)) for v in values))
        ]
        return " ".join(["jointbench init", *(quote(str(log)) for log in logs), model, "-o case", *options])

    @property
    def _verdict(self) -> str:
        """The file of the verdict; empty where none is written."""
        return "" if self.json in (None, PRINTED) else str(self.json)

    def _of_logs_alone(self) -> list[str]:
        """Options that came and say something of logs."""
        came = {
            "--map": self.map, "--unit": self.unit, "--judge": self.judge, "--rate": self.rate, "--assume": self.assume
        }  # fmt: skip
        return [option for option, value in came.items() if value]

    def _of_logs(self, logs: list[Path], models: list[Path]) -> None:
        from bench.discrepancy.intake.asking import case_from
        from bench.discrepancy.intake.assumptions import Assumptions
        from bench.discrepancy.report.answers import Files
        from bench.errors import ParameterError

        if len(models) != 1:
            raise ParameterError(
                f"{len(models)} models came ({', '.join(map(str, models))}); one is expected"
            )
        with (
            _stages(self.progress) as stage,
            case_from(
                logs,
                models[0],
                judging=self.judge,
                columns=pairs("--map", self.map),
                units=pairs("--unit", self.unit),
                rate=self.rate,
                assumptions=Assumptions().changed(pairs("--assume", self.assume)),
            ) as (case, made),
        ):
            told = Console(stderr=True, soft_wrap=True)
            for line in made.assumed:
                told.print(f"assumed: {line}", markup=False, highlight=False)
            found = _diagnosed(self, case, stage)
            model = quote(str(models[0]))
            files = Files(f"--model {model} --case case", self._verdict, self._draft(logs, model))
            document, written, problem = self._results(found, stage, made.assumed, files)
        self._told(found, document, written, problem, files)

    def _results(
        self,
        found: Diagnosis | ArticulatedDiagnosis,
        stage: Callable[[str], None],
        assumed: tuple[str, ...],
        files: Files,
    ) -> tuple[dict[str, Any], list[Path], Exception | None]:
        """The verdict as a document, and its files written."""
        document = found.verdict.to_json()
        document["warnings"] = [*document["warnings"], *(f"assumed: {line}" for line in assumed)]
        return document, *self._written(found, document, stage, files)

    def _told(
        self,
        found: Diagnosis | ArticulatedDiagnosis,
        document: dict[str, Any],
        written: list[Path],
        problem: Exception | None,
        files: Files,
    ) -> None:
        if self.json == PRINTED:
            emit(document)
        else:
            for part in verdict_summary(found.verdict, files):
                Console().print(part, markup=False, highlight=False)
            for path in written:
                print(f"written: {path}")
        for warning in found.verdict.warnings:
            Console(stderr=True, soft_wrap=True).print(
                f"note: {warning}", style="yellow", markup=False, highlight=False
            )
        if problem is not None:
            raise problem

    def _written(
        self,
        diagnosis: Diagnosis | ArticulatedDiagnosis,
        document: dict[str, Any],
        stage: Callable[[str], None],
        files: Files,
    ) -> tuple[list[Path], Exception | None]:
        """The files written, moved into place together; where one fails, the verdict alone, and what failed."""
        from bench.files import OutputError, together, write_text

        text = json.dumps(document, indent=1, ensure_ascii=False)
        saved = [self.json] if self.json is not None and self.json != PRINTED else []
        try:
            with together():
                for path in saved:
                    write_text(path, text)
                if self.html is not None:
                    from bench.discrepancy import write_report
                    from bench.discrepancy.intake.first_record import in_simulator

                    stage("the judging records in your simulator, with what is named")
                    applied = in_simulator(diagnosis.verdict, diagnosis.case)
                    stage(f"writing {self.html}")
                    write_report(diagnosis, self.html, applied=applied, files=files)
                if self.rrd is not None:
                    from bench.discrepancy.report.rerun_recording import write_rerun

                    stage(f"writing {self.rrd}")
                    write_rerun(diagnosis, self.rrd)
                planned = getattr(diagnosis, "next_test", None)
                if self.next_test is not None and planned is not None:
                    write_text(
                        self.next_test,
                        planned.as_csv([(joint.name, joint.unit) for joint in diagnosis.problem.joints]),
                    )
        except Exception as error:  # whatever a figure ran into: the verdict is told and kept
            problem = OutputError(f"the report of this verdict cannot be written: {error}")
            with contextlib.suppress(OutputError):
                for path in saved:
                    write_text(path, text)
                return saved, problem
            return [], problem
        following = self.next_test if planned is not None else None
        return [path for path in (*saved, self.html, self.rrd, following) if path is not None], None

    def _check_places(self) -> None:
        """Refuse places that cannot be written to before a minute is spent on the diagnosis."""
        from bench.errors import ParameterError
        from bench.targets import check_targets

        if self.most < 1:
            raise ParameterError(f"--most is {self.most}; at least one effect has to be allowed")
        if self.budget is not None and not self.budget > 0.0:
            raise ParameterError(f"--budget is {self.budget:g} s; give more than zero")
        check_targets(self.json, self.html, self.rrd, self.next_test, force=self.force)


@contextlib.contextmanager
def _stages(shown: bool) -> Iterator[Callable[[str], None]]:
    """A line on standard error with what is being done and for how long; call what is given with the text."""
    if not shown:  # a disabled display of rich before 15 still ends with an empty line
        yield lambda text: None
        return
    columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=None)
        yield lambda text: bar.update(task, description=text)


def _diagnosed(asked: Diagnose, case: Case, stage: Callable[[str], None]) -> Diagnosis | ArticulatedDiagnosis:
    """The diagnosis of a case; what numerics cannot cope with is told like any other input that cannot be used."""
    import numpy as np

    from bench.discrepancy import diagnose
    from bench.discrepancy.precheck.checking import check
    from bench.discrepancy.replay.own_share import with_simulator
    from bench.discrepancy.settings import DEFAULT, read_settings
    from bench.errors import IdentificationError

    settings = DEFAULT if asked.settings is None else read_settings(asked.settings)
    if asked.check:
        stage("looking at the records")
        told = Console(stderr=True, soft_wrap=True)
        looked = check(case, informed=False)
        # what is unusable is refused below, in the same words
        for doubt in () if looked.word == "unusable" else looked.doubts:
            told.print(f"check: {doubt}", style="yellow", markup=False, highlight=False)
    try:
        found = diagnose(
            case,
            exclude=asked.exclude,
            most=asked.most,
            anyway=asked.anyway,
            progress=stage,
            budget=asked.budget,
            settings=settings,
        )
        stage("the simulator's own share")
        return replace(found, verdict=with_simulator(found.verdict, case))
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise IdentificationError(
            f"the numbers of '{case.name}' cannot be worked with ({error}); check nominal values, units and noise_std: "
            "one of them is probably off by orders of magnitude"
        ) from error
