"""The diagnosis of several cases at once, and one page of all."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from rich.console import Console
from rich.table import Table

from bench.cli.console import emit
from bench.cli.paths import PRINTED

Stages = Callable[[bool], AbstractContextManager[Callable[[str], None]]]


def diagnose_fleet(asked: Any, stages: Stages) -> None:
    """Diagnose the cases of a command, tell of all in one table, and write what was asked for."""
    import json

    from bench.discrepancy.report.fleet import DiagnosisOptions, diagnose_cases, fleet_page, fleet_rows
    from bench.errors import ParameterError
    from bench.files import json_values, together, write_text

    if asked.rrd is not None:
        raise ParameterError("--rrd is of one case; diagnose it on its own")
    options = DiagnosisOptions(asked.exclude, asked.most, asked.anyway, asked.budget)
    with stages(asked.progress) as stage:
        found = diagnose_cases(asked.cases, options, scheduler=asked.scheduler, progress=stage)
    document = {"cases": found}
    text = json.dumps(json_values(document), indent=1, ensure_ascii=False)
    with together():
        if asked.json is not None and asked.json != PRINTED:
            write_text(asked.json, text + "\n")
        if asked.html is not None:
            fleet_page(found).write(asked.html)
    if asked.json == PRINTED:
        emit(document)
        return
    header, lines = fleet_rows(found)
    table = Table(*header)
    for line in lines:
        table.add_row(*line)
    Console().print(table)
    for path in (asked.json, asked.html):
        if path is not None:
            print(f"written: {path}")
