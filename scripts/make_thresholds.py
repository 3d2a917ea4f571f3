"""Writes docs/thresholds.md from the settings of the diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bench.discrepancy.settings import DEFAULT, described
from bench.files import write_text

PAGE = Path(__file__).resolve().parents[1] / "docs" / "thresholds.md"
HEAD = """# Thresholds

Every threshold of the diagnosis is a field of a small frozen dataclass in `bench.discrepancy.settings`, one a room. This page is
written from them by `scripts/make_thresholds.py`. Another value is passed as `diagnose(case, settings=…)`, or from a file:

<!-- not run: takes your case and thresholds -->
```sh
jointbench diagnose CASE --settings thresholds.toml
```

```toml
[search.restarts]
draws = 96
```

What differs from its default stands under `settings` in the verdict and gives the same settings again; a name that is not known is
refused, with the nearest one. `jointbench schema settings` gives the JSON Schema. Tables of `scripts/perturb_settings.py` say which
of these values change verdicts when they are moved. "Convention" marks a value that rests on neither a derivation nor a study;
"a cost cut-off" one that saves time and is to change no verdict.
"""


def text_of(value: Any) -> str:
    """A value as it would be written in a document."""
    if isinstance(value, tuple):
        return ", ".join(text_of(entry) for entry in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def page() -> str:
    """The page."""
    lines, room = [HEAD], None
    for entry in described(DEFAULT):
        table = entry.path.rpartition(".")[0]
        if table != room:
            room = table
            lines.append(f"\n## {f'`{table}`' if table else 'All rooms'}\n")
            lines.append("| name | default | unit | meaning | reason |\n|---|---|---|---|---|")
        name = entry.path.rpartition(".")[2]
        cells = (f"`{name}`", text_of(entry.default), entry.unit, entry.meaning, entry.reason)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    write_text(PAGE, page())
    print(PAGE)
