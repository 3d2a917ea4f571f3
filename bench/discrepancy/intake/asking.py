"""The diagnosis of logs against a model, without a case folder of one's own."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.discrepancy.case.case import Case
from bench.discrepancy.case.reading import read_case
from bench.discrepancy.intake.assumptions import Assumptions
from bench.discrepancy.intake.drafting import Draft, draft
from bench.discrepancy.intake.logs import log_of
from bench.discrepancy.intake.models import model_file


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
        yield read_case(folder), made
