"""Diagnosis of the sim-to-real gap: where it lies, which effect causes it, how far it shrinks once that is added.

`diagnose_folder` reads a case (nominal parameters with uncertainties, and records) and returns a `Diagnosis`; its
`verdict` is what it says. The names are imported on first use, so that `import bench.discrepancy` compiles nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bench.discrepancy.blind.protocol import BlindOptions, make_blind, run_blind
    from bench.discrepancy.blind.scoring import BlindScore, score_blind
    from bench.discrepancy.case.case import (
        Case,
        CaseChannel,
        CaseRecord,
        NominalParameter,
        record_from_arrays,
    )
    from bench.discrepancy.case.reading import read_case
    from bench.discrepancy.diagnosis import Diagnosis, diagnose, diagnose_folder
    from bench.discrepancy.effects.catalogue import CATALOGUE
    from bench.discrepancy.effects.effect import Effect, FreeParameter
    from bench.discrepancy.report.html_page import write_report
    from bench.discrepancy.report.rerun_recording import write_rerun
    from bench.discrepancy.verdict import Verdict

_HOMES = {
    "CATALOGUE": "effects.catalogue",
    "BlindOptions": "blind.protocol",
    "BlindScore": "blind.scoring",
    "Case": "case.case",
    "CaseChannel": "case.case",
    "CaseRecord": "case.case",
    "Diagnosis": "diagnosis",
    "Effect": "effects.effect",
    "FreeParameter": "effects.effect",
    "NominalParameter": "case.case",
    "Verdict": "verdict",
    "diagnose": "diagnosis",
    "diagnose_folder": "diagnosis",
    "make_blind": "blind.protocol",
    "read_case": "case.reading",
    "record_from_arrays": "case.case",
    "run_blind": "blind.protocol",
    "score_blind": "blind.scoring",
    "write_report": "report.html_page",
    "write_rerun": "report.rerun_recording",
}

__all__ = [
    "CATALOGUE",
    "BlindOptions",
    "BlindScore",
    "Case",
    "CaseChannel",
    "CaseRecord",
    "Diagnosis",
    "Effect",
    "FreeParameter",
    "NominalParameter",
    "Verdict",
    "diagnose",
    "diagnose_folder",
    "make_blind",
    "read_case",
    "record_from_arrays",
    "run_blind",
    "score_blind",
    "write_report",
    "write_rerun",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    import importlib  # noqa: PLC0415

    module = importlib.import_module(f"{__name__}.{_HOMES[name]}")
    value = getattr(module, name)
    globals()[name] = value
    return value
