"""Commands for records: look at them, bring them into another format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from bench.cli.console import emit
from bench.cli.paths import Out


def pairs(option: str, texts: Sequence[str]) -> dict[str, str]:
    """Entries NAME=VALUE of an option.

    Raises:
        ParameterError: One is none, or a name comes twice.
    """
    from bench.errors import ParameterError

    out: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.rpartition("=")
        if not sign or not name.strip() or not value.strip():
            raise ParameterError(f"{option} '{text}' came; NAME=VALUE is expected, as in {option} force=kN")
        if name.strip() in out:
            raise ParameterError(f"{option} names '{name.strip()}' twice; once is enough")
        out[name.strip()] = value.strip()
    return out


@dataclass
class Convert:
    """Read a record from any format and write it in another (.parquet, which keeps everything; .csv, .npz, .mat).

    Example: jointbench convert test.mat -o test.parquet --map "force=run.data[:, 2]" --unit force=kN --si
    """

    record: tyro.conf.Positional[Path]
    """Record: any file that the bench reads."""
    output: Out
    """File; its suffix says the format."""
    map: tuple[str, ...] = ()
    """Channels to take, CHANNEL=COLUMN; every column by default."""
    unit: tuple[str, ...] = ()
    """Units that the file does not tell, CHANNEL=UNIT."""
    time: str = ""
    """Column of the time, where its name does not tell."""
    rate: float = 0.0
    """Sample rate [Hz] of a file without a time."""
    resample: float = 0.0
    """Sample rate [Hz] to bring the record to, behind an anti-alias filter."""
    si: bool = False
    """Bring every channel to SI units."""
    bridge: bool = False
    """Bridge short dropouts by interpolation."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a file that exists."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.record_files import read_recording
        from bench.record_files.plain_writing import write_record
        from bench.targets import check_targets

        check_targets(self.output, force=self.force)
        record = read_recording(
            self.record,
            columns=pairs("--map", self.map) or None,
            units=pairs("--unit", self.unit),
            time=self.time,
            sample_rate=self.rate,
            gaps="interpolate" if self.bridge else "raise",
        )
        record = record.to_si() if self.si else record
        record = record.resample(self.resample) if self.resample else record
        write_record(self.output, record)
        channels = [{"name": c.name, "unit": c.unit, "quantity": c.quantity} for c in record.channels]
        if self.json:
            size = {"samples": len(record.time), "sample_rate": record.sample_rate}
            emit({"file": str(self.output), **size, "channels": channels})
            return
        print(f"{self.output}: {len(record.time)} samples at {record.sample_rate:g} Hz")
        for channel in channels:
            print(f"  {channel['name']} [{channel['unit']}] {channel['quantity']}".rstrip())


@dataclass
class Plot:
    """Draw records: over time, over frequency, or one channel over another (.png, .svg, .pdf).

    Example: jointbench plot run.csv model.csv -o run.png --channels displacement force
    """

    records: tyro.conf.Positional[tuple[Path, ...]]
    """Records; several are drawn over each other."""
    output: Out = Path("record.png")
    """File of the picture."""
    kind: Literal["time", "spectrum", "loop"] = "time"
    """What is drawn; a loop is the second channel over the first."""
    channels: tuple[str, ...] = ()
    """Channels; all of the first record by default, for a loop the displacement and the force of its element."""
    window: tuple[float, float] | None = None
    """First and last time [s]."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a file that exists."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.errors import ParameterError
        from bench.figures import loops, save, spectrum, time_histories
        from bench.record_files import read_recording
        from bench.targets import check_targets

        if not self.records:
            raise ParameterError("give at least one record, as in: jointbench plot run.csv -o run.png")
        check_targets(self.output, force=self.force)
        found = {str(path): read_recording(path) for path in self.records}
        channels = self.channels or next(iter(found.values())).names
        if self.kind == "loop":
            figure = loops(found, [self._pair(next(iter(found.values())))], window=self.window)
        elif self.kind == "spectrum":
            figure = spectrum(found, channels)
        else:
            figure = time_histories(found, channels, window=self.window)
        save(figure, self.output)
        if self.json:
            emit({"file": str(self.output), "kind": self.kind, "channels": list(channels)})
            return
        print(f"written: {self.output}")

    def _pair(self, record: object) -> tuple[str, str]:
        from bench.errors import ParameterError
        from bench.joint_models.records import elements_of

        if len(self.channels) == 2:
            return self.channels[0], self.channels[1]
        found = elements_of(record)  # type: ignore[arg-type]
        if self.channels or not found:
            raise ParameterError(
                "a loop is one channel over another; name two with --channels, as in --channels displacement force"
            )
        from bench.figures import element_loops

        return element_loops(record, found[0])[0]  # type: ignore[arg-type]
