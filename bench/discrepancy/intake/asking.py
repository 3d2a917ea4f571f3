"""The diagnosis of logs against a model, without a case folder of one's own."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.case.case import Case
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.diagnosis import Diagnosis
from bench.discrepancy.intake.assumptions import Assumptions
from bench.discrepancy.intake.drafting import Draft, draft
from bench.discrepancy.intake.logs import log_of
from bench.discrepancy.intake.models import model_file
from bench.discrepancy.replay.own_share import with_simulator
from bench.discrepancy.report.answers import answers
from bench.discrepancy.verdict import Verdict
from bench.errors import MissingPackageError


def drafted(
    logs: Sequence[Any],
    model: Any,
    folder: Path,
    *,
    judging: Sequence[Any] = (),
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    assumptions: Assumptions | None = None,
    rate: float = 0.0,
) -> tuple[Draft, list[Path]]:
    """Draft a case from logs and a model, and write it into a folder; arguments as of `case_from`."""
    with model_file(model) as file:
        made = draft(
            [log_of(log, rate=rate, name=f"log {k + 1}") for k, log in enumerate(logs)],
            file,
            judging=[log_of(log, rate=rate, name=f"judging log {k + 1}") for k, log in enumerate(judging)],
            asked=columns,
            units=units,
            assumptions=assumptions,
        )
        return made, made.write(folder)


@contextlib.contextmanager
def case_from(logs: Sequence[Any], model: Any, **options: Any) -> Iterator[tuple[Case, Draft]]:
    """A case from logs and a model, whose folder stands for as long as it is needed.

    Args:
        logs: Files, Recordings, DataFrames, or mappings of columns to arrays.
        model: MJCF as path or text, MjSpec or MjModel.
        **options: `judging` logs; `columns`, what columns stand for ("elbow.position", an actuator, a sensor, "-"); `units` of columns;
            `assumptions`; `rate` [Hz] of logs without a time.
    """
    with tempfile.TemporaryDirectory() as folder:
        made, _ = drafted(logs, model, Path(folder), **options)
        case = read_case(folder)
        yield replace(case, name=Path(case.rig).stem), made


@dataclass(frozen=True, eq=False)
class Answer:
    """A diagnosis of logs against a model, as a notebook shows it.

    Attributes:
        verdict: What it says.
        diagnosis: All behind it, for `write_report` and `write_rerun`.
        assumed: What was assumed, a sentence each.
    """

    verdict: Verdict
    diagnosis: Diagnosis | ArticulatedDiagnosis
    assumed: tuple[str, ...]
    folder: tempfile.TemporaryDirectory[str] = field(repr=False)
    """Folder of the case, which lives as long as this."""

    def to_pandas(self) -> Any:
        """Parameters of the named effects and the nominal parameters as re-estimated, a row each.

        Raises:
            MissingPackageError: pandas is not installed.
        """
        try:
            import pandas as pd  # noqa: PLC0415  (not needed by the bench)
        except ImportError:
            raise MissingPackageError("a DataFrame needs pandas: pip install pandas") from None
        rows = [
            {"what": e.name, "where": e.where or e.channel, "parameter": name, "value": x.value, "std": x.std, "unit": x.unit,
             "closed": e.closed}
            for e in self.verdict.named
            for name, x in e.parameters.items()
        ]  # fmt: skip
        rows += [
            {"what": "nominal", "where": "", "parameter": p.name, "value": p.value, "std": p.std, "unit": "", "closed": float("nan")}
            for p in self.verdict.nominal
        ]  # fmt: skip
        return pd.DataFrame(rows, columns=["what", "where", "parameter", "value", "std", "unit", "closed"])

    def plot(self) -> Any:
        """The judging record, measured and simulated before and after, over time: a matplotlib figure."""
        from bench.discrepancy.report.articulated import simulated_joints  # noqa: PLC0415
        from bench.discrepancy.report.simulated_records import variants  # noqa: PLC0415
        from bench.figures import time_histories  # noqa: PLC0415

        robot = isinstance(self.diagnosis, ArticulatedDiagnosis)
        runs = simulated_joints(self.diagnosis) if robot else variants(self.diagnosis)  # type: ignore[arg-type]
        names = list(runs.values())[-1].names
        responses = {c.name for c in self.diagnosis.case.channels if c.role == "response"}
        return time_histories(runs, [n for n in names if robot or n in responses])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th>{escape(question)}</th><td>{escape(answer)}</td></tr>"
            for question, answer in answers(self.verdict)
        )
        return f"<p>{escape(self.verdict.explanation)}</p><table>{rows}</table>"


def diagnose(model: Any, records: Any, **options: Any) -> Answer:
    """Diagnose records against a model, in Python.

    Args:
        model: MJCF as path or text, `mujoco.MjSpec` or `mujoco.MjModel`.
        records: One log or several: files, Recordings, DataFrames, or mappings of columns to arrays; the last one judges.
        **options: `judging`, `columns`, `units`, `assumptions`, `rate` as of `case_from`; the others as of
            `bench.discrepancy.diagnose` (`exclude`, `most`, `budget`, `progress`, …).

    Raises:
        BenchError: As the command `jointbench diagnose`.

    Example:
        >>> answer = diagnose("stage.xml", [run_1, run_2], columns={"x": "guide.position"})  # doctest: +SKIP
        >>> answer.to_pandas()  # doctest: +SKIP
    """
    from bench.discrepancy.diagnosis import diagnose as ask  # noqa: PLC0415

    several = isinstance(records, (list, tuple))
    own = {
        key: options.pop(key)
        for key in ("judging", "columns", "units", "assumptions", "rate")
        if key in options
    }
    folder = tempfile.TemporaryDirectory()
    made, _ = drafted(records if several else [records], model, Path(folder.name), **own)
    case = read_case(folder.name)
    found = ask(case, **options)
    verdict = with_simulator(found.verdict, case)
    return Answer(verdict, replace(found, verdict=verdict), made.assumed, folder)
