"""The README's example runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

README = Path(__file__).resolve().parent.parent / "README.md"


def test_example_in_the_readme_runs(capsys):
    code = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    exec(compile(code.group(1), "README.md", "exec"), {})
    unit, peak = capsys.readouterr().out.split()
    assert unit == "N"
    assert float(peak) > 20.0  # the spring beyond the gap takes more than the shaker gives


def test_figures_of_measured_records_are_those_of_the_results():
    results = (README.parent / "docs" / "results.md").read_text(encoding="utf-8")
    quoted = re.findall(
        r"\| ([\d.e-]+ → [\d.e-]+)(?: m| V)?(?: at 80 lb)? \|", README.read_text(encoding="utf-8")
    )
    assert len(quoted) >= 5
    assert [figure for figure in quoted if figure not in results] == []
