"""Which modules are public, found by their files; nothing is imported."""

from __future__ import annotations

import ast
import itertools
from pathlib import Path


def sources(root: Path) -> dict[str, Path]:
    """Files of all public modules of `bench` and `envs` below a checkout, by name."""
    made = {}
    for package in ("bench", "envs"):
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            parts = parts[:-1] if parts[-1] == "__init__" else parts
            if not any(part.startswith("_") for part in parts):
                made[".".join(parts)] = path
    return made


def undocumented(root: Path) -> list[str]:
    """Names that a public module exports in its ``__all__`` and that no page tells of.

    A page tells of a name where the module that defines it is public and gives it a docstring; a module has a page of its own.
    """
    found = sources(root)
    trees = {name: ast.parse(path.read_text("utf-8")) for name, path in found.items()}
    packages = {name for name, path in found.items() if path.name == "__init__.py"}

    def told(module: str, name: str) -> bool:
        if f"{module}.{name}" in trees:
            return True
        body = [
            inner
            for node in trees[module].body
            for inner in (node.body if isinstance(node, ast.If) else [node])
        ]
        for node, after in itertools.zip_longest(body, body[1:]):
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
                return ast.get_docstring(node) is not None
            if name in _assigned(node):
                return isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    if (alias.asname or alias.name) == name:
                        home = _imported_from(node, module, module in packages)
                        return home in trees and told(home, alias.name)
        return False

    exported = [(module, name) for module, tree in trees.items() for name in _exported(tree)]
    return [f"{module}.{name}" for module, name in exported if not told(module, name)]


def _assigned(node: ast.AST | None) -> list[str]:
    """Names that a statement assigns to."""
    targets = (
        node.targets
        if isinstance(node, ast.Assign)
        else [node.target]
        if isinstance(node, ast.AnnAssign)
        else []
    )
    return [target.id for target in targets if isinstance(target, ast.Name)]


def _imported_from(node: ast.ImportFrom, module: str, package: bool) -> str:
    """The module that names are imported from, of relative imports too."""
    if not node.level:
        return node.module or ""
    parts = module.split(".") if package else module.split(".")[:-1]
    return ".".join(part for part in [*parts[: len(parts) - node.level + 1], node.module] if part)


def _exported(tree: ast.Module) -> list[str]:
    """Names of a module's ``__all__``."""
    for node in tree.body:
        if "__all__" in _assigned(node):
            assert isinstance(node, ast.Assign)
            return list(ast.literal_eval(node.value))
    return []
