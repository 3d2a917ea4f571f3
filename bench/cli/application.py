"""The command that puts a verdict into the user's own model and tells what it is worth there."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.console import Console

from bench.cli.console import emit
from bench.cli.paths import PRINTED

if TYPE_CHECKING:
    from bench.discrepancy.application.applying import Applied, Findings
    from bench.discrepancy.case.case import Case
    from bench.discrepancy.replay.verification import Verification


@dataclass
class Apply:
    """Put what a diagnosis found into your own MJCF, and run the judging records in it before and after."""

    verdict: tyro.conf.Positional[Path]
    """Verdict that `diagnose --json` wrote."""
    model: Path
    """Your MJCF."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """File for the corrected MJCF; what MJCF cannot hold goes into a snippet beside it, of the same name and the suffix .py."""
    case: Path | None = None
    """Case folder of the verdict, for its judging records; the verdict's own folder where it is one."""
    json: Path | None = None
    """File for the verdict with what was done and what it is worth under `applied`; "-", or nothing at the end, prints it."""
    ranges: Path | None = None
    """File for ranges for domain randomisation, .json or .yaml."""
    nearest: bool = False
    """Apply what comes nearest where the verdict is "unknown"."""
    force: bool = False
    """Overwrite files that exist."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy.application.applying import apply
        from bench.discrepancy.application.reading import findings_of, gaps_left, read_verdict
        from bench.discrepancy.application.writing import snippet
        from bench.discrepancy.replay.verification import is_articulated, verify
        from bench.targets import check_targets

        code = self.output.with_suffix(".py")
        check_targets(self.output, code, self.json, self.ranges, force=self.force)
        document, verdict = read_verdict(self.verdict)
        findings = findings_of(verdict, nearest=self.nearest)
        case = self._case()
        applied = apply(self.model, findings, case=case, linear=not is_articulated(findings, case))
        applied.compiled()
        with Console(stderr=True).status("applying") as status:
            worth = (
                None
                if case is None
                else verify(self.model, findings, gaps_left(verdict), case, progress=status.update)
            )
        written = self._written(applied, findings, code if snippet(applied, self.output.name) else None)
        document["applied"] = {
            "model": str(self.output),
            "changes": [change.to_json() for change in applied.changes],
            **({} if worth is None else worth.to_json()),
        }
        self._told(document, applied, worth, written)

    def _case(self) -> Case | None:
        from bench.discrepancy.case.reading import read_case

        folder = self.case
        if folder is None and (self.verdict.parent / "nominal.json").is_file():
            folder = self.verdict.parent
        return None if folder is None else read_case(folder)

    def _written(self, applied: Applied, findings: Findings, code: Path | None) -> list[Path]:
        from bench.discrepancy.application.writing import ranges_text, write_model, write_snippet
        from bench.files import together, write_text

        out = [self.output]
        with together():
            write_model(applied, self.output, self.model.name)
            if code is not None:
                write_snippet(applied, code, self.output.name)
                out.append(code)
            if self.ranges is not None:
                write_text(self.ranges, ranges_text(findings, self.ranges.suffix.lower()))
                out.append(self.ranges)
        return out

    def _told(
        self, document: dict[str, Any], applied: Applied, worth: Verification | None, written: list[Path]
    ) -> None:
        from bench.discrepancy.application.writing import told
        from bench.files import json_values, write_text

        if self.json == PRINTED:
            emit(document)
            return
        console = Console()

        def say(text: str) -> None:
            console.print(text, markup=False, highlight=False, soft_wrap=True)

        for change in applied.changes:
            say(told(change))
        if worth is None:
            say("not run: give the case folder (--case) to see what it is worth in your simulator")
        else:
            for line in filter(
                None, (worth.line, worth.remedy, worth.less, worth.simulator_line, worth.together_line)
            ):
                say(line)
        if self.json is not None:
            text = json.dumps(json_values(document), indent=1, ensure_ascii=False, allow_nan=False)
            write_text(self.json, text + "\n")
            written.append(self.json)
        for path in written:
            say(f"written: {path}")
