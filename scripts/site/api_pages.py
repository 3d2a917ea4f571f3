"""A page for every public module, made while the site is built; what stands on it, mkdocstrings takes from the docstrings."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import mkdocs_gen_files

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from documentation.sources import sources  # noqa: E402

SUMMARY = "reference/api/SUMMARY.md"


def first_line(path: Path) -> str:
    """What a module says of itself first."""
    return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").partition("\n")[0]


def write() -> None:
    """Write the pages, their index, and the entries of the navigation."""
    found = sources(ROOT)
    lines, entries = ["# Modules", "", "| module | what it holds |", "|---|---|"], ["* [Modules](index.md)\n"]
    for name, path in found.items():
        lines.append(f"| [`{name}`]({name}.md) | {first_line(path)} |")
        entries.append(f"* [{name}]({name}.md)\n")
        with mkdocs_gen_files.open(f"reference/api/{name}.md", "w") as page:
            page.write(f"::: {name}\n")
    with mkdocs_gen_files.open("reference/api/index.md", "w") as page:
        page.write("\n".join([*lines, ""]))
    with mkdocs_gen_files.open(SUMMARY, "w") as page:
        page.writelines(entries)


write()
