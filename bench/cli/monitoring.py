"""The command that watches a damper in service."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit

if TYPE_CHECKING:
    from bench.monitoring import DamperMonitor
    from bench.recording import Recording


@dataclass
class Monitor:
    """Watch a damper: learn it on the first periods of a record, then tell when it has changed, from when on and by how much."""

    record: tyro.conf.Positional[Path]
    """Motion and force in service: CSV, Parquet, MAT, npz or HDF5."""
    displacement: str = "displacement"
    """Channel of the displacement (or rotation)."""
    force: str = "force"
    """Channel of the force (or torque), positive along the velocity where it brakes."""
    velocity: str = "velocity"
    """Channel of the velocity; found from the displacement where the record has none."""
    unit: Annotated[tuple[str, ...], tyro.conf.arg(metavar="CHANNEL=UNIT")] = ()
    """Units of channels that the file does not tell, as force=kN."""
    centre: float | None = None
    """Displacement about which the motion goes [SI]; the middle of the learning by default."""
    learning: int = 30
    """Periods to learn from."""
    change: float = 0.12
    """Smallest change of a period's energy to be found, as a share; what a fifth of C lost leaves beside some friction."""
    run_length: float = 2000.0
    """Mean number of periods between false alarms."""
    figure: Path | None = None
    """Picture of the course to write (.png, .svg, .pdf)."""
    force_overwrite: Annotated[bool, tyro.conf.arg(name="overwrite")] = False
    """Overwrite a picture that exists."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.monitoring import MonitorSettings, monitor_record
        from bench.targets import check_targets

        check_targets(self.figure, force=self.force_overwrite, option="--overwrite")
        settings = MonitorSettings(learning=self.learning, change=self.change, run_length=self.run_length)
        record = self._read()
        x, v = record[self.displacement], record[self.velocity]
        centre = self.centre
        if centre is None:
            centre = 0.5 * float(x.min() + x.max())
        monitor = monitor_record(record.time, x, v, record[self.force], settings, centre=centre)
        if self.figure is not None:
            from bench.figures import save
            from bench.figures.monitoring import monitored

            save(monitored(monitor), self.figure)
        told = self._told(monitor, record)
        if self.json:
            emit(told)
        else:
            _print(told)

    def _read(self) -> Recording:
        """The record in SI units, with a velocity."""
        import numpy as np

        from bench.errors import ParameterError, UnitError
        from bench.record_files import read_recording

        pairs = [text.partition("=") for text in self.unit]
        wrong = [name for name, sign, unit in pairs if not (name and sign and unit)]
        if wrong:
            raise ParameterError(f"--unit {wrong[0]} came; CHANNEL=UNIT is expected, as force=kN")
        record = read_recording(
            self.record, units={name: unit for name, _, unit in pairs}, gaps="interpolate"
        ).to_si()
        for name, units in ((self.displacement, ("m", "rad")), (self.force, ("N", "N m"))):
            if record.channel(name).unit not in units:  # named with the channels there are, if missing
                raise UnitError(
                    f"channel '{name}' is in {record.channel(name).unit}; {' or '.join(units)}, or a unit of that dimension, is expected: "
                    f"--unit {name}=… says which"
                )
        if self.velocity in record.names:
            return record
        unit = f"{record.channel(self.displacement).unit}/s"
        velocity = np.gradient(record[self.displacement], 1.0 / record.sample_rate)
        return record.with_channels({self.velocity: velocity}, units={self.velocity: unit})

    def _told(self, monitor: DamperMonitor, record: Recording) -> dict[str, Any]:
        learnt = monitor.baseline
        assert learnt is not None
        judged = [period for period in monitor.judged if period.inside]
        last = monitor.judged[-1] if monitor.judged else None
        return {
            "record": str(self.record),
            "verdict": "changed" if monitor.alarms else ("unchanged" if judged else "nothing judged"),
            "alarms": [alarm._asdict() for alarm in monitor.alarms],
            "learnt": {
                "periods": self.learning,
                "coefficient": learnt.coefficient,
                "exponent": learnt.exponent,
                "unit": f"{record.channel(self.force).unit} ({record.channel(self.velocity).unit})^-n",
                "scatter": learnt.scatter,
            },
            "now": None if last is None else {"coefficient": last.coefficient, "exponent": last.exponent},
            "threshold": learnt.threshold,
            "reference": learnt.reference,
            "run_length": self.run_length,
            "judged": len(judged),
            "outside": len(monitor.judged) - len(judged),
            "periods": [
                period._asdict() | {"z": None if math.isnan(period.z) else period.z}
                for period in monitor.judged
            ],
        }


def _print(told: dict[str, Any]) -> None:
    learnt = told["learnt"]
    console = Console()
    console.print(
        f"Learnt on {learnt['periods']} periods: C = {learnt['coefficient']:.5g} {learnt['unit']}, n = {learnt['exponent']:.3f}; "
        f"energies of periods scatter by {100.0 * learnt['scatter']:.2g} %.",
        markup=False,
        highlight=False,
    )
    outside = f", {told['outside']} not judged for motion that was not learnt" if told["outside"] else ""
    console.print(
        f"{told['judged']} periods judged{outside}: {told['verdict']}.", markup=False, highlight=False
    )
    if told["alarms"]:
        table = Table(
            "found at [s]".replace("[", r"\["), "in period", "since period", "energy over that learnt"
        )
        for alarm in told["alarms"]:
            table.add_row(
                f"{alarm['time']:.4g}",
                str(alarm["number"]),
                str(alarm["since"]),
                f"{100.0 * alarm['share']:.1f} %",
            )
        console.print(table)
