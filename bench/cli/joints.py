"""Commands of the core job: a joint identified from records, swapped into a rig, compared with the true one, exported."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit
from bench.cli.paths import Out


@dataclass
class Identify:
    """Identify a reduced-order joint from records of its motion and force.

    Example: jointbench identify run_1.csv run_2.csv --model network --displacement x --restoring-force f --joint carriage -o joint.json

    Of records that `simulate` wrote, the motion and force of their element are taken. Otherwise name the columns; where the force
    is not measured, --applied, --acceleration and --mass give it (r = F - m a).
    """

    records: tyro.conf.Positional[tuple[Path, ...]]
    """Records: any file that the bench reads."""
    model: Annotated[str, tyro.conf.arg(metavar="polynomial|network|law|...")] = "polynomial"
    """Kind of model; a wrong one lists all."""
    output: Out = Path("joint.json")
    """File for the joint."""
    judge: tuple[Path, ...] = ()
    """Records for judging; without them the last fifth of each record is held out."""
    joint: tuple[str, ...] = ()
    """Joints or tendons that the joint will act on, one a coordinate; those of the element by default."""
    name: str = ""
    """Name of the joint; that of the element by default, so that `compare` finds its like."""
    element: str = ""
    """Element of simulated records."""
    displacement: tuple[str, ...] = ()
    """Columns of the relative displacements."""
    velocity: tuple[str, ...] = ()
    """Columns of the relative velocities; differences of the displacements where left out."""
    restoring_force: tuple[str, ...] = ()
    """Columns of the restoring forces, positive where they oppose a positive displacement."""
    applied: tuple[str, ...] = ()
    """Columns of the forces applied to the body, in the place of --restoring-force."""
    acceleration: tuple[str, ...] = ()
    """Columns of the accelerations of the body, with --applied."""
    mass: tuple[float, ...] = ()
    """Masses or inertias of the body, with --applied."""
    body: Literal["first", "second"] = "second"
    """Body of the joint that --applied acts on."""
    law: tuple[str, ...] = ()
    """Laws to fit, with --model law; the best is kept (`jointbench laws` lists them)."""
    order: int = 3
    """Highest power of a polynomial."""
    hidden: int = 30
    """Hidden units of a network."""
    starts: int = 8
    """Random starts of a network or a law."""
    seed: int = 0
    """Seed of the starts."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a file that exists."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.errors import ParameterError, UnknownNameError
        from bench.joint_models import KINDS, JointColumns, Settings, write_joint
        from bench.joint_models.identifying import identified
        from bench.record_files import read_recording
        from bench.targets import check_targets

        if self.model not in KINDS:
            raise UnknownNameError("kind of joint model", self.model, KINDS)
        if not self.records:
            raise ParameterError(
                "give at least one record, as in: jointbench identify run.csv --model polynomial"
            )
        check_targets(self.output, force=self.force)
        columns = JointColumns(
            self.displacement, self.velocity, self.restoring_force, self.applied, self.acceleration, self.mass,
            self.element, self.body,
        )  # fmt: skip
        settings = Settings(self.order, self.hidden, self.law, self.starts, seed=self.seed)
        records = {str(path): read_recording(path) for path in self.records}
        judged = {str(path): read_recording(path) for path in self.judge}
        with Console(stderr=True).status("identifying"):
            joint = identified(self.model, records, columns, settings, judged, self.joint, self.name)
        write_joint(self.output, joint)
        document = {"file": str(self.output), **joint.to_dict()}
        if self.json:
            emit(document)
            return
        title = f"{self.output}: {self.model}, {joint.element.law.name}"
        table = Table("NMSE of the force [%]", *joint.element.joints, title=title)
        for label, values in joint.scores.items():
            table.add_row(label, *(f"{x:.4g}" for x in values))
        Console().print(table)
        for key, value in joint.report.get("parameters", {}).items():
            print(f"{key} = {value:.6g} ± {joint.report['std'].get(key, 0.0):.2g}")
        for key in ("displacement", "velocity", "force"):
            print(f"{key}: {', '.join(joint.source[key])}")


@dataclass
class Swap:
    """Put an identified joint in the place of the true one in a rig.

    Example: jointbench swap rig.toml joint.json -o reduced.json
    """

    rig: tyro.conf.Positional[Path]
    """Rig (TOML or JSON), or an MJCF file."""
    joint: tyro.conf.Positional[Path]
    """Joint that `identify` wrote."""
    output: Out = Path("reduced.json")
    """File for the rig with it, JSON."""
    replace: tuple[str, ...] = ()
    """Elements that go; by default the one of the joint's name, else those on its joints."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a file that exists."""

    def __call__(self) -> None:
        """Run the command."""
        import json

        from bench.files import write_text
        from bench.joint_models import read_joint
        from bench.joint_models.swapping import swapped
        from bench.targets import check_targets

        check_targets(self.output, force=self.force)
        document, gone = swapped(self.rig, read_joint(self.joint), self.output.parent, self.replace)
        write_text(self.output, json.dumps(document, indent=1, ensure_ascii=False) + "\n")
        if self.json:
            emit({"file": str(self.output), "replaced": gone})
            return
        print(f"{self.output}: {', '.join(gone) or 'nothing'} replaced by the joint of {self.joint}")


@dataclass
class Compare:
    """Drive a rig with its true joint and with the reduced one alike, and tell how far they part.

    Example: jointbench compare rig.toml joint.json --seed 7 --picture compared.png
    """

    rig: tyro.conf.Positional[Path]
    """Rig with the true joint, and what drives it (TOML or JSON)."""
    reduced: tyro.conf.Positional[Path]
    """Joint that `identify` wrote, or a rig that `swap` wrote."""
    seed: int | None = None
    """Seed of the excitation; that of the file by default, or 0. Take another one than that of the identification."""
    picture: Path | None = None
    """File for the two records over time (.png, .svg, .pdf)."""
    channels: tuple[str, ...] = ()
    """Channels of the picture; those that both have by default."""
    rrd: Path | None = None
    """File for a rerun recording of both."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite files that exist."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.joint_models.swapping import compared
        from bench.targets import check_targets

        check_targets(self.picture, self.rrd, force=self.force)
        rigs, result = compared(self.rig, self.reduced, self.seed)
        both = {"true": result.true, "reduced": result.reduced}
        written = []
        if self.picture is not None:
            from bench.figures import save, time_histories

            save(time_histories(both, self.channels or tuple(result.nmse)), self.picture)
            written.append(self.picture)
        if self.rrd is not None:
            from bench.rerun_log import log_comparison

            log_comparison(self.rrd, rigs, both)
            written.append(self.rrd)
        if self.json:
            emit({"nmse_percent": result.nmse, "files": [str(path) for path in written]})
            return
        table = Table("channel", "NMSE [%]", title=f"{self.reduced} against {self.rig}")
        for name, value in result.nmse.items():
            table.add_row(name, f"{value:.4g}")
        Console().print(table)
        for path in written:
            print(f"written: {path}")


@dataclass
class Export:
    """Write an identified joint for another tool: Nastran (.bdf), MJCF (.xml), Python (.py), ONNX (.onnx).

    Example: jointbench export joint.json -o joint.bdf --components 1 4 --bodies 3 4
    """

    joint: tyro.conf.Positional[Path]
    """Joint that `identify` wrote."""
    output: Out
    """File; its suffix says the format."""
    mjcf: Path | None = None
    """MJCF model that the joint goes into, for .xml."""
    components: tuple[int, ...] = ()
    """Nastran components, one a coordinate: 1 to 3 translations, 4 to 6 rotations."""
    bodies: tuple[int, int] = (1, 2)
    """Nastran grids that the joint connects."""
    units: Literal["SI", "inch-pound"] = "SI"
    """Units of the Nastran deck."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite files that exist."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.joint_export import ExportOptions, export_joint, written_by
        from bench.joint_models import read_joint
        from bench.targets import check_targets

        check_targets(*written_by(self.output), force=self.force)
        joint = read_joint(self.joint)
        options = ExportOptions(self.mjcf, self.components, self.bodies, self.units)
        export_joint(joint, self.output, options)
        files = [str(path) for path in written_by(self.output) if path.exists()]
        if self.json:
            emit({"files": files, "law": joint.element.law.name})
            return
        for path in files:
            print(f"written: {path}")
