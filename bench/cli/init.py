"""The command that drafts a case folder from logs and a model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bench.cli.console import emit
from bench.cli.records import pairs


@dataclass
class Init:
    """Draft a case folder from logs and an MJCF: nominal.json with everything that is assumed, to be edited, and the records.

    Example: jointbench init run_1.csv run_2.csv arm.xml -o my-case --map q1=shoulder.position u1=shoulder.command
    """

    logs: tyro.conf.Positional[tuple[Path, ...]]
    """Logs in any format that the bench reads, and the MJCF; the last log judges, of a single log its last third."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder for the case."""
    map: tuple[str, ...] = ()
    """What columns stand for, COLUMN=JOINT.position (velocity, acceleration, torque, command), COLUMN=ACTUATOR, COLUMN=SENSOR, COLUMN=-."""
    unit: tuple[str, ...] = ()
    """Units that headings do not tell, COLUMN=UNIT."""
    judge: tuple[Path, ...] = ()
    """Logs that judge."""
    rate: float = 0.0
    """Sample rate [Hz] of logs without a time."""
    assume: tuple[str, ...] = ()
    """How well numbers of the model are known, KIND=SHARE or KIND=FACTOR (mass, stiffness, damping, frictionloss, armature, kp, kv,
    forcerange; twins, by how much drives of one type differ): kp=0.1 to ten percent, kp=10, the default, to a factor of ten."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a case folder that exists."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy.intake.asking import drafted
        from bench.discrepancy.intake.assumptions import Assumptions
        from bench.errors import ParameterError
        from bench.targets import check_target_folder

        models = [path for path in self.logs if path.suffix == ".xml"]
        logs = [path for path in self.logs if path.suffix != ".xml"]
        if len(models) != 1 or not logs:
            raise ParameterError(
                f"{len(logs)} log(s) and {len(models)} model(s) came; give logs and one MJCF, as in: "
                "jointbench init run.csv model.xml -o case"
            )
        check_target_folder(self.output, force=self.force)
        made, written = drafted(
            logs,
            models[0],
            self.output,
            judging=self.judge,
            columns=pairs("--map", self.map),
            units=pairs("--unit", self.unit),
            rate=self.rate,
            assumptions=Assumptions().changed(pairs("--assume", self.assume)),
        )
        if self.json:
            emit({"folder": str(self.output), "files": [path.name for path in written], "assumed": list(made.assumed)})  # fmt: skip
            return
        for line in made.assumed:
            print(f"assumed: {line}")
        for path in written:
            print(f"written: {path}")
        print(
            f"Edit {self.output / 'nominal.json'}: how sure you are of each parameter, noise_std where you know it; then "
            f"jointbench diagnose {self.output}"
        )
