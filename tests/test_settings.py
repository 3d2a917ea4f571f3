"""Settings of the diagnosis: described, threaded, documented; and no thresholds beside them."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from bench.discrepancy import settings as settings_room
from bench.discrepancy.settings import DEFAULT, changed, described, read_settings, settings_of, with_values
from bench.errors import DocumentError, UnknownEntryError

ROOT = Path(__file__).resolve().parents[1]
MOST_CONSTANTS = 60
"""Module constants with a number in bench and envs: each physical, mathematical or a format's."""
NUMERICAL = {"np", "numpy", "math"}
PLAIN = {
    "abs", "complex", "dict", "float", "frozenset", "int", "list",
    "max", "min", "range", "round", "set", "slice", "sum", "tuple",
}  # fmt: skip
OURS = {name for name in settings_room.__all__ if name.endswith("Settings")}
"""Classes of settings that belong to those of a diagnosis."""
UNTHREADED = {"application", "blind", "intake", "precheck", "rehearsal", "replay", "report"}
"""Rooms that make or check cases rather than diagnose them; they work by the defaults."""
ADMITTING = {"admission.py", "against_model.py", "against_mujoco.py"}
"""Files of the room of arms that do so, too."""


def numeric(node: ast.expr) -> bool:
    """Whether a value is made of numbers: a literal, arithmetic, a container or a numerical function of them."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float | complex) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return numeric(node.operand)
    if isinstance(node, ast.BinOp):
        return numeric(node.left) or numeric(node.right)
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return any(map(numeric, node.elts))
    if isinstance(node, ast.Dict):
        return any(numeric(entry) for entry in (*node.values, *filter(None, node.keys)))
    if isinstance(node, ast.Call):
        function = ast.unparse(node.func)
        known = function.split(".")[0] in NUMERICAL or function in PLAIN | {"MappingProxyType", "Polynomial"}
        return known and any(numeric(entry) for entry in (*node.args, *(k.value for k in node.keywords)))
    return False


def constants() -> Iterator[str]:
    """Module-level assignments of numbers."""
    for package in ("bench", "envs"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.parse(path.read_text()).body:
                if isinstance(node, ast.Assign | ast.AnnAssign) and node.value and numeric(node.value):
                    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
                    yield f"{path.relative_to(ROOT)}: {ast.unparse(target)}"


def test_numbers_of_modules_are_few():
    found = list(constants())
    assert len(found) <= MOST_CONSTANTS, "\n".join(found)


@pytest.mark.parametrize(
    "text",
    ["X = 1.0", "X = -2", "X = (1, 2)", "X: int = 3", "X = 2.0 * Y", "X = np.zeros(3)", "X = {'a': 1}"],
)
def test_numbers_are_seen(text):
    node = ast.parse(text).body[0]
    assert isinstance(node, ast.Assign | ast.AnnAssign)
    assert node.value is not None
    assert numeric(node.value)


def sources() -> dict[Path, ast.Module]:
    folder = ROOT / "bench" / "discrepancy"
    return {p: ast.parse(p.read_text()) for p in folder.rglob("*.py") if "settings" not in p.parts}


def test_every_setting_is_read_and_described():
    read = {n.attr for tree in sources().values() for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    entries = list(described(DEFAULT))
    assert len(entries) > 200
    assert [e.path for e in entries if e.path.rpartition(".")[2] not in read] == []
    assert [
        e.path for e in entries if not (e.meaning.endswith(".") and e.reason.endswith(".") and e.unit)
    ] == []


def test_who_has_settings_passes_them_on():
    trees = sources()
    taking: dict[str, set[str]] = {}
    for path, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                arguments = [a for a in (*node.args.args, *node.args.kwonlyargs) if a.arg == "settings"]
                if any(a.annotation is not None and ast.unparse(a.annotation) in OURS for a in arguments):
                    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
                    taking.setdefault(node.name, set()).add(module)
    missing = []
    for path, tree in trees.items():
        room = path.relative_to(ROOT / "bench" / "discrepancy").parts[0]
        if room in UNTHREADED or (room == "articulated" and path.name in ADMITTING):
            continue
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        known = {
            n.name for n in tree.body if isinstance(n, ast.FunctionDef) and module in taking.get(n.name, ())
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                known |= {a.asname or a.name for a in node.names if node.module in taking.get(a.name, ())}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in known:
                texts = [ast.unparse(a) for a in (*node.args, *(k.value for k in node.keywords))]
                if not any(
                    "settings" in text or text in ("chosen", "how", "judged") for text in texts
                ) and not any(k.arg is None for k in node.keywords):
                    missing.append(f"{path.relative_to(ROOT)}:{node.lineno}: {node.func.id}")
    assert missing == []


def test_what_differs_gives_the_same_settings_again(tmp_path):
    settings = with_values(
        DEFAULT, {"seed": 7, "search": {"restarts": {"scales": (1.0, 3.0)}}, "screening": {"draws": 32}}
    )
    told = changed(settings)
    assert told == {"seed": 7, "search": {"restarts": {"scales": [1.0, 3.0]}}, "screening": {"draws": 32}}
    assert settings_of(told) == settings
    assert changed(DEFAULT) == {}
    file = tmp_path / "thresholds.toml"
    file.write_text("seed = 7\n[search.restarts]\nscales = [1.0, 3.0]\n[screening]\ndraws = 32\n")
    assert read_settings(file) == settings
    with pytest.raises(FrozenInstanceError):
        settings.search.thorough = 3


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"serch": {}}, "Did you mean 'search'"),
        ({"search": {"thoruogh": 3}}, "Did you mean 'thorough'"),
    ],
)
def test_misspelt_names_are_refused_with_the_nearest(data, words):
    with pytest.raises(UnknownEntryError, match=words):
        settings_of(data)


@pytest.mark.parametrize("value", [-1.0, "much", True, float("nan")])
def test_values_of_another_kind_are_refused(value):
    with pytest.raises(DocumentError, match=r"screening\.worth_a_fit"):
        settings_of({"screening": {"worth_a_fit": value}})


def test_page_of_thresholds_is_that_of_the_classes():
    sys.path.insert(0, str(ROOT / "scripts"))
    from make_thresholds import PAGE, page

    assert PAGE.read_text() == page()
