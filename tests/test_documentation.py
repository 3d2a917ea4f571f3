"""The documentation: its pages say what the code says, its examples run, its links lead somewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from documentation import effects, laws, snippets  # noqa: E402
from documentation.sources import sources  # noqa: E402

import docs  # noqa: E402

QUICK = ("README.md", "docs/start-joint.md", "docs/how-to/own-law.md", "docs/ten-tasks.md")
"""Pages whose examples run here; `make docs` runs those of all."""


def test_pages_made_from_the_code_are_those_of_the_code():
    assert docs.stale(docs.pages()) == [], "run `python scripts/docs.py`"


def test_every_law_and_effect_says_what_it_is_taken_for_and_how_it_looks():
    assert set(laws.RELATIVES) == set(laws.LAWS)
    assert {relative for near in laws.RELATIVES.values() for relative in near} <= set(laws.LAWS)
    assert set(laws.NATIVE) <= set(laws.LAWS)
    assert [name for name in effects.names() if not effects.look_of(name)] == []


@pytest.mark.slow
@pytest.mark.parametrize("page", QUICK)
def test_examples_run(page, tmp_path):
    assert snippets.run_page(ROOT / page, tmp_path, slow=False) > 0


def test_every_example_runs_or_says_why_not():
    languages = {
        found
        for page in snippets.pages()
        for found in re.findall(r"^```(\w+)$", page.read_text("utf-8"), re.MULTILINE)
    }
    assert languages <= {"python", "sh", "json", "toml", "text", "math", "mermaid", "xml"}, (
        "a block is run, data, or plain text"
    )
    for page in snippets.pages():
        for snippet in snippets.snippets(page):
            if snippet.language == "sh" and not snippet.reason:
                first = {
                    line.split()[0]
                    for line in snippet.code.splitlines()
                    if line.strip() and not line.startswith((" ", "#"))
                }
                assert first <= set(snippets.COMMANDS), f"{page}:{snippet.line}"


def test_links_lead_to_files():
    missing = []
    for page in [*snippets.pages(), *(ROOT / "docs" / "reference").rglob("*.md")]:
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target and not (page.parent / target).exists():
                missing.append(f"{page.relative_to(ROOT)}: {target}")
    assert missing == []


def test_every_public_module_says_what_it_holds():
    import ast

    silent = [
        name
        for name, path in sources(ROOT).items()
        if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert silent == []


def test_every_page_is_in_the_navigation():
    navigation = (ROOT / "scripts" / "site" / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    listed = set(re.findall(r"([\w/.-]+\.(?:md|ipynb))$", navigation, re.MULTILINE))
    folders = (
        "reference/laws",
        "reference/effects",
        "reference/environments",
    )  # whole folders are listed by their names
    pages = {
        p.relative_to(ROOT / "docs").as_posix()
        for kind in ("*.md", "*.ipynb")
        for p in (ROOT / "docs").rglob(kind)
    }
    assert {page for page in pages if not page.startswith(folders)} == listed
