"""Structure: no circle of files, nothing too large, one name for one thing, no order of hashes, few files beside the rooms."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DIAGNOSIS = ROOT / "bench" / "discrepancy"
LEAVES = {"verdict", "verdict_schema", "settings"}
"""Types of results and thresholds, which any room may use: not drawn."""
LARGEST_ROOM, MOST_LOOSE = 2500, 4
"""Lines of a room of the diagnosis, and files beside its rooms."""
LARGEST_FILE, LARGEST_FUNCTION, LARGEST_CLASS = 350, 60, 300
"""Lines of a file, and of a function and a class without their docstrings; tests, one file a subject, are not counted."""
COMPILED_LOOPS = {
    "bench/discrepancy/articulated_truth/time_stepping.py: _march",
    "bench/discrepancy/simulation/equations_of_motion.py: derivative",
    "bench/discrepancy/simulation/prescribed_response.py: _driven",
    "bench/discrepancy/simulation/stick_slip.py: _free_run",
    "bench/discrepancy/truth/moreau_steps.py: march_through",
    "bench/excitation/stepping.py: _advance_single",
    "bench/laws/memory.py: force",
}
"""Functions that stay whole: one compiled loop each, whose parts would pass a dozen numbers to one another, or a kernel of a law,
one C function that calls no other."""
COMMANDS = {"BlindScore", "Design"}
"""Names that a command shares with what it prints: a command is called what a person types."""


def modules() -> dict[str, Path]:
    """Every module of the project, a package by its ``__init__``."""
    found = {}
    for package in ("bench", "envs"):
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name: str, tree: ast.AST, package: bool, known: set[str]) -> Iterator[str]:
    """Modules that a module imports anywhere: within functions and for type checkers only as well."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            parts = name.split(".") if package else name.split(".")[:-1]
            base = ".".join(parts[: len(parts) - node.level + 1]) if node.level else ""
            source = ".".join(part for part in (base, node.module) if part)
            for alias in node.names:
                inner = f"{source}.{alias.name}"
                yield inner if inner in known else source


def graph(sources: dict[str, tuple[str, bool]]) -> dict[str, set[str]]:
    """Module to the modules it imports, from texts and whether each is a package."""
    known = set(sources)
    return {
        name: {m for m in imported(name, ast.parse(text), package, known) if m in known and m != name}
        for name, (text, package) in sources.items()
    }


def circle(edges: dict[str, set[str]]) -> list[str]:
    """A circle of imports; empty where there is none."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_file_imports_itself_by_way_of_others():
    sources = {name: (path.read_text(), path.name == "__init__.py") for name, path in modules().items()}
    assert len(sources) > 200
    assert circle(graph(sources)) == []


@pytest.mark.parametrize(
    "text",
    [
        "from bench.a import x",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from bench.a import x",
        "def f():\n    from .a import x",
        "from bench import a",
        "import bench.a",
    ],
)
def test_circles_are_found(text):
    sources = {"bench": ("", True), "bench.a": ("import bench.b", False), "bench.b": (text, False)}
    assert set(circle(graph(sources))) == {"bench.a", "bench.b"}


def test_diagnosis_lives_in_rooms():
    loose = [path.name for path in DIAGNOSIS.glob("*.py")]
    assert len(loose) <= MOST_LOOSE, loose
    for room in (path for path in DIAGNOSIS.iterdir() if path.is_dir() and path.name != "__pycache__"):
        lines = sum(len(path.read_text().splitlines()) for path in room.glob("*.py"))
        assert lines <= LARGEST_ROOM, room.name


parsed = cache(ast.parse)
"""Syntax tree of a text; several tests walk the same ones."""


def docstring_lines(node: ast.FunctionDef | ast.ClassDef) -> int:
    """Lines of the docstring of a function or class, and of those within it."""
    inner = (n for n in ast.walk(node) if isinstance(n, ast.FunctionDef | ast.ClassDef))
    docs = (n.body[0] for n in inner if ast.get_docstring(n) is not None)
    return sum((doc.end_lineno or 0) - doc.lineno + 1 for doc in docs)


@cache
def code() -> dict[str, str]:
    """Text of every file that runs, tests left out, by its path."""
    paths = (path for top in ("bench", "envs", "scripts", "examples") for path in (ROOT / top).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): path.read_text() for path in paths}


def too_large(files: dict[str, str]) -> set[str]:
    """Files, and functions and classes in them, that are longer than the limits."""
    found = set()
    for name, text in files.items():
        found |= {name} if len(text.splitlines()) > LARGEST_FILE else set()
        for node in ast.walk(parsed(text)):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                most = LARGEST_CLASS if isinstance(node, ast.ClassDef) else LARGEST_FUNCTION
                lines = (node.end_lineno or 0) - node.lineno + 1 - docstring_lines(node)
                found |= {f"{name}: {node.name}"} if lines > most else set()
    return found


def test_files_functions_and_classes_are_short():
    assert too_large(code()) == COMPILED_LOOPS


def test_what_is_too_large_is_found():
    body = "    x = 1\n" * LARGEST_FUNCTION
    assert too_large({"a.py": f"def short():\n    'It.'\n{body[:-10]}"}) == set()
    assert too_large({"a.py": f"class A:\n  def long():\n{body.replace('    ', '      ')}"}) == {"a.py: long"}


def defined_twice(files: dict[str, str]) -> dict[str, list[str]]:
    """Public classes and types that more than one file defines, with the files."""
    found: dict[str, list[str]] = {}
    for path, text in files.items():
        for node in parsed(text).body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            names = [target.id for target in targets if isinstance(target, ast.Name)]
            names = [node.name] if isinstance(node, ast.ClassDef) else names
            # a name in CamelCase is a type, one in capitals a constant
            for name in names:
                if name[0].isupper() and not name.isupper() and path not in found.setdefault(name, []):
                    found[name].append(path)
    return {name: paths for name, paths in found.items() if len(paths) > 1}


def test_one_name_is_one_type():
    packages = {path: text for path, text in code().items() if not path.startswith(("scripts", "examples"))}
    assert set(defined_twice(packages)) == COMMANDS


def test_names_defined_twice_are_found():
    texts = {"a.py": "class Row: ...\nPair = tuple\nLIMIT = 1", "b.py": "Row = int\nLIMIT = 2\nOther = 3"}
    assert defined_twice(texts) == {"Row": ["a.py", "b.py"]}


def drawn(page: str) -> set[tuple[str, str]]:
    """Arrows of the picture on the page of the architecture."""
    picture = page.split("```mermaid")[1].split("```", maxsplit=1)[0]
    return {tuple(line.strip().split(" --> ")) for line in picture.splitlines() if " --> " in line}  # type: ignore[misc]


def rooms_imported() -> set[tuple[str, str]]:
    """Imports between rooms, without those that longer ways imply."""
    sources = {name: (path.read_text(), path.name == "__init__.py") for name, path in modules().items()}
    prefix = "bench.discrepancy."
    edges: dict[str, set[str]] = {}
    for name, targets in graph(sources).items():
        for target in targets:
            both = name.startswith(prefix) and target.startswith(prefix)
            room, other = name.removeprefix(prefix).split(".")[0], target.removeprefix(prefix).split(".")[0]
            if both and room != other and not {room, other} & LEAVES:
                edges.setdefault(room, set()).add(other)

    def reached(room: str) -> set[str]:
        below = edges.get(room, set())
        return below | {further for other in below for further in reached(other)}

    return {
        (room, other)
        for room, below in edges.items()
        for other in below
        if not any(other in reached(between) for between in below - {other})
    }


def test_architecture_is_drawn_as_it_is():
    assert drawn((ROOT / "docs" / "architecture.md").read_text()) == rooms_imported()


def _is_set(node: ast.AST) -> bool:
    """Whether an expression is a set as it stands there."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub | ast.BitAnd | ast.BitOr | ast.BitXor):
        return _is_set(node.left) or _is_set(node.right) or _calls(node.left, "keys")
    return isinstance(node, ast.Set | ast.SetComp) or _calls(node, "set") or _calls(node, "frozenset")


def _calls(node: ast.AST, *names: str) -> bool:
    """Whether an expression is a call of one of these functions or methods."""
    if not isinstance(node, ast.Call):
        return False
    called = node.func
    return (called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")) in names


def ordered_as_hashed(text: str) -> list[int]:
    """Lines that go through a set where the order tells: it is that of the hashes, which differ from process to process."""
    tree, found = parsed(text), []
    orderless = {
        id(argument)
        for node in ast.walk(tree)
        if _calls(node, "sorted", "set", "frozenset", "any", "all", "min", "max", "len")
        for argument in node.args  # pyrefly: ignore[missing-attribute]
    }
    for node in ast.walk(tree):
        loops = [node.iter] if isinstance(node, ast.For) else []
        if isinstance(node, ast.ListComp | ast.DictComp | ast.GeneratorExp) and id(node) not in orderless:
            loops += [part.iter for part in node.generators]
        if _calls(node, "tuple", "list", "fromkeys", "enumerate", "zip"):
            loops += node.args  # pyrefly: ignore[missing-attribute]
        if isinstance(node, ast.List | ast.Tuple):
            loops += [part.value for part in node.elts if isinstance(part, ast.Starred)]
        found += [loop.lineno for loop in loops if _is_set(loop)]
    return sorted(found)


def test_nothing_is_in_the_order_of_hashes():
    lines = {path: ordered_as_hashed(text) for path, text in code().items()}
    assert {path: found for path, found in lines.items() if found} == {}


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("for x in {f(y) for y in z}: pass", [1]),
        ("a = [x for x in one.keys() - two.keys()]", [1]),
        ("a = {x: 1 for x in set(z)}", [1]),
        ("a = tuple({x for x in z})", [1]),
        ("a = [*{1, 2}]", [1]),
        ("a = sorted(x for x in set(z))", []),
        ("a = {x for x in set(z)} | {*one}", []),
        ("for x in sorted({f(y) for y in z}): pass", []),
    ],
)
def test_orders_of_hashes_are_found(text, lines):
    assert ordered_as_hashed(text) == lines


def test_tests_bind_to_public_names():
    inner = [
        f"{path.name}: {alias.name}"
        for path in (ROOT / "tests").rglob("*.py")
        for node in ast.walk(parsed(path.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(("bench", "envs"))
        for alias in node.names
        if alias.name.startswith("_")
    ]
    assert inner == []
