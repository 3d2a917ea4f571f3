"""The documentation: its pages say what the code says, its examples run, its links lead somewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from documentation import effects, equations, flowchart, laws, mathml, snippets  # noqa: E402
from documentation.sources import sources, undocumented  # noqa: E402

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


def test_every_public_name_has_a_page():
    assert undocumented(ROOT) == []


def test_every_public_name_without_a_docstring_is_told(tmp_path):
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "__init__.py").write_text(
        '"""A package."""\nfrom bench.room import Told, silent\n__all__ = ["Told", "silent"]\n'
    )
    (tmp_path / "bench" / "room.py").write_text('"""A room."""\nTold = 1\n"""What it is."""\nsilent = 2\n')
    assert undocumented(tmp_path) == ["bench.silent"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("f = Fc tanh(v / vr)", r"f &= F_{c}\,\tanh\left(\frac{v}{v_{r}}\right)"),
        ("f = z, z' = k1 v - z / tau", "f &= z \\\\\n\\dot{z} &= k_{1} v - \\frac{z}{\\tau}"),
        ("f = c |v|^(n-1) v", r"f &= c {\left\lvert v \right\rvert}^{n - 1} v"),
        (
            "f = k+ q for q > 0, else 0",
            r"f &= \begin{cases} k^{+} q & \text{for}\ q > 0 \\ 0 & \text{else} \end{cases}",
        ),
        ("f = rate t q, set-valued at rest", r"f &= \mathrm{rate}\,t q,\ \text{set-valued at rest}"),
    ],
)
def test_an_equation_in_plain_text_is_set_as_latex(text, expected):
    assert equations.display(text, ["rate"]) == f"\\begin{{split}}\n{expected}\n\\end{{split}}"


@pytest.mark.parametrize("text", ["f = k q ^", "f = (k q", "f = k q ~ 2", "f = ) q"])
def test_what_is_no_equation_is_refused(text):
    with pytest.raises(ValueError, match=r"missing|closed|what is"):
        equations.display(text)


def test_every_equation_of_the_pages_is_set_without_a_command_left_over():
    pages = [page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md")]
    shown = [
        found
        for page in pages
        for found in re.findall(r"^```math\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    ]
    assert len(shown) > len(laws.LAWS)
    assert all(mathml.mathml(latex, display=True).startswith("<math") for latex in shown)
    with pytest.raises(ValueError, match="cannot be set"):
        mathml.mathml(r"\begin{aligned} f &= 1 \end{aligned}")


def test_the_architecture_is_drawn_from_its_text():
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    chart = text.split("```mermaid")[1].split("```", maxsplit=1)[0]
    boxes, lines = flowchart.layout(flowchart.arrows(chart))
    assert len(lines) == chart.count("-->")
    assert all(boxes[tail].xy[1] < boxes[head].xy[1] for tail, head in flowchart.arrows(chart))
    assert flowchart.svg(chart).count("<rect") == len(boxes)
    with pytest.raises(ValueError, match="flow chart"):
        flowchart.arrows("flowchart LR\n a --> b")


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
