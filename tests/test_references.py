"""References in docstrings and docs: what stands in backticks is the name of something that exists."""

from __future__ import annotations

import ast
import builtins
import importlib
import importlib.util
import re
from functools import cache
from pathlib import Path

import numpy
import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCES = sorted(path for package in ("bench", "envs") for path in (ROOT / package).rglob("*.py"))
SINGLE = re.compile(r"(?<!`)`([A-Za-z_][\w.]*)`(?!`)")
OWN = {"bench", "envs"}
OTHERS = {"copy", "gymnasium", "mujoco", "numpy", "scipy", "torch"}
MUJOCO = "mj"
"""How names of MuJoCo's C code begin."""


def texts(tree: ast.AST) -> list[str]:
    """Docstrings, those of attributes and constants included."""
    return [
        node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ]


@cache
def known() -> frozenset[str]:
    """Every identifier of the project and every text in it: names of laws, channels, effects and entries of files are texts."""
    names = set(dir(builtins))
    for path in SOURCES:
        names.add(path.parent.name if path.name == "__init__.py" else path.stem)
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Name):
                names.add(node.id)
            elif isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.arg) or (isinstance(node, ast.keyword) and node.arg):
                names.add(node.arg)
            elif isinstance(node, ast.FunctionDef | ast.ClassDef):
                names.add(node.name)
            elif isinstance(node, ast.alias):
                names |= {*node.name.split("."), node.asname or node.name}
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and "\n" not in node.value:
                names |= set(re.split(r"[^\w]+", node.value))
    return frozenset(names)


def outside(name: str) -> bool:
    """Whether a library has what a dotted name says."""
    parts = name.split(".")
    for k in range(len(parts) - 1, 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        return hasattr(found, parts[k]) or importlib.util.find_spec(".".join(parts[: k + 1])) is not None
    return False


def resolves(name: str) -> bool:
    """Whether a dotted name is that of a module of the project or of something in one."""
    parts = name.split(".")
    if parts[0].startswith(MUJOCO):
        return True
    if parts[0] in OTHERS and len(parts) > 1:
        return outside(name)
    if parts[0] not in OWN:
        return all(part in known() for part in parts) or hasattr(numpy, name)
    for k in range(len(parts), 0, -1):
        if (ROOT.joinpath(*parts[:k]).with_suffix(".py")).is_file() or ROOT.joinpath(*parts[:k]).is_dir():
            found = importlib.import_module(".".join(parts[:k])) if k < len(parts) else None
            return all(hasattr(found, part) for part in parts[k : k + 1])
    return False


@pytest.mark.parametrize("package", ["bench", "envs"])
def test_docstrings_name_what_exists(package):
    stale = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in SOURCES
        if path.is_relative_to(ROOT / package)
        for text in texts(ast.parse(path.read_text()))
        for name in SINGLE.findall(text)
        if not resolves(name)
    ]
    assert stale == []


def test_pages_name_modules_that_exist():
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    stale = [
        f"{page.name}: {name}"
        for page in pages
        for name in re.findall(r"`((?:bench|envs)\.[\w.]+)`", page.read_text())
        if not resolves(name)
    ]
    paths = [
        f"{page.name}: {path}"
        for page in pages
        for path in re.findall(r"`((?:bench|envs|scripts|tests)/[\w./]+\.py)`", page.read_text())
        if not (ROOT / path).is_file()
    ]
    assert stale + paths == []


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("bench.rig", True),
        ("bench.rig.Rig", True),
        ("bench.rig.nothing", False),
        ("bench.discrepancy.no_such_room", False),
        ("nothing_of_the_kind", False),
    ],
)
def test_resolving(name, there):
    assert resolves(name) is there
