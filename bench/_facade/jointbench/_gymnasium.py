"""Registers the environments with gymnasium, without anybody importing them.

Gymnasium up to 0.29 asked packages for that by the entry point ``gymnasium.envs``; from 1.0 on it asks nobody. Therefore
``jointbench_gymnasium.pth`` imports this module when Python starts, and it waits until `gymnasium.envs.registration` is imported:
until then it costs nothing but its own import, and where gymnasium is never imported, nothing else ever.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec

TYPE_CHECKING = False  # `typing` would be imported whenever Python starts
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any

REGISTRATION = "gymnasium.envs.registration"
IDS = (
    "JointBench/SDOFExcitation-v0",
    "JointBench/JointExcitation-v0",
    "JointBench/Discrimination-v0",
    "JointBench/ModelExcitation-v0",
)
"""Those of `envs.IDS`, which is not imported for this."""


def register() -> None:
    """Register the environments; what makes them is imported when they are made."""
    module = sys.modules[REGISTRATION]
    for identifier in IDS:
        name = identifier.partition("/")[2].removesuffix("-v0")
        if identifier not in module.registry:
            single, vector = ("model", "model") if name == "ModelExcitation" else ("single", "vector")
            module.register(
                id=identifier,
                entry_point=f"jointbench.envs.{single}:{name}Env",
                vector_entry_point=f"jointbench.envs.{vector}:{name}VectorEnv",
            )


class Waiting:
    """Registers once gymnasium's registry is there; finds nothing itself."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Leave the search to the other finders, and register when the module they found is loaded."""
        if fullname != REGISTRATION:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            spec.loader.exec_module = _followed(spec.loader.exec_module)  # pyrefly: ignore[bad-assignment]
        return spec


def _followed(load: Callable[[ModuleType], Any]) -> Callable[[ModuleType], None]:
    def exec_module(module: ModuleType) -> None:
        load(module)
        register()

    return exec_module


def wait() -> None:
    """Register now where gymnasium is imported already, else as soon as it is."""
    if REGISTRATION in sys.modules:
        register()
    elif not any(isinstance(finder, Waiting) for finder in sys.meta_path):
        sys.meta_path.insert(0, Waiting())  # pyrefly: ignore[bad-argument-type]


wait()
