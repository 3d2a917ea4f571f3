"""Finds the packages that are installed beside this one, and lends them this one's name.

A program may have a folder `bench` or `envs` of its own on the path. Modules of the bench import one another as ``bench.…``, so that
name has to be the bench's; `envs` imports its parts relative to itself, so where the name is taken it is `jointbench.envs`.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, module_from_spec, spec_from_file_location

TYPE_CHECKING = False  # `typing` and `pathlib` would be imported whenever Python starts
if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

FACADE = __name__.partition(".")[0]
_ABOVE = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
ROOT = os.path.dirname(os.path.dirname(_ABOVE)) if os.path.basename(_ABOVE) == "_facade" else _ABOVE
"""Folder that holds `bench` and `envs`: that of this package where it is installed, the checkout where it is not."""


def own(name: str) -> ModuleType:
    """Return the bench's package `name`, "bench" or "envs", imported at most once.

    Raises:
        ImportError: Another `bench` was imported before.
    """
    loaded = sys.modules.get(name)
    if _is_own(getattr(loaded, "__file__", None), name):
        assert loaded is not None
        return loaded
    if name == "bench":
        if loaded is not None:
            raise ImportError(
                f"a module of your own called 'bench' is imported already ({getattr(loaded, '__file__', None)}); the modules "
                f"of {FACADE} go by that name: rename yours"
            )
        return _load(name, name)
    own("bench")  # which the others import
    alias = f"{FACADE}.{name}"
    if alias in sys.modules:
        return sys.modules[alias]
    found = None if loaded is not None else find_spec(name)
    foreign = loaded is not None or (found is not None and not _is_own(found.origin, name))
    return _load(alias if foreign else name, name)


def follow() -> None:
    """Let packages of the bench be imported as parts of this one."""
    if not any(isinstance(finder, _Alias) for finder in sys.meta_path):
        # before the finder of files, which would find the parts of a package a second time in its folder
        sys.meta_path.insert(0, _Alias())


def _is_own(file: str | None, name: str) -> bool:
    return file is not None and os.path.realpath(file) == os.path.join(ROOT, name, "__init__.py")


def _spec(module: str, package: str) -> ModuleSpec:
    folder = os.path.join(ROOT, package)
    file = os.path.join(folder, "__init__.py")
    found = spec_from_file_location(module, file, submodule_search_locations=[folder])
    assert found is not None
    return found


def _load(module: str, package: str) -> ModuleType:
    spec = _spec(module, package)
    made = module_from_spec(spec)
    sys.modules[module] = made
    try:
        assert spec.loader is not None
        spec.loader.exec_module(made)
    except BaseException:
        del sys.modules[module]
        raise
    return made


class _Alias:
    """Finds ``jointbench.x`` as ``bench.x``, and ``jointbench.envs`` as the bench's own `envs`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not fullname.startswith(f"{FACADE}."):
            return None
        part = fullname.removeprefix(f"{FACADE}.")
        if part in {"_own", "_gymnasium", "__main__"}:
            return None
        if part == "envs" or part.startswith("envs."):
            envs = own("envs").__name__
            if envs == f"{FACADE}.envs" and part != "envs":
                return None  # its parts are found in its folder
            name = envs + part.removeprefix("envs")
        else:
            own("bench")
            name = f"bench.{part}"
            if find_spec(name) is None:
                return None
        return ModuleSpec(fullname, _Existing(name), is_package=True)  # pyrefly: ignore[bad-argument-type]


class _Existing:
    """Gives out a module under a further name."""

    def __init__(self, name: str) -> None:
        self.name = name

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = import_module(self.name)
        self.spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self.spec  # which the import system has replaced
