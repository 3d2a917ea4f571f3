"""The vector environment of practice benches."""

from __future__ import annotations

from typing import Any

from bench.errors import UnknownNameError

from .base import options_of, setup_of
from .practice import PracticeBenches
from .vector import BenchVectorEnv


class PracticeVectorEnv(BenchVectorEnv):
    """Vector environment of practice benches; see the module.

    Not registered: its reward looks at the hidden rig.
    """

    KINDS = ("sdof", "joint", "discrimination")

    def __init__(self, kind: str, num_envs: int = 1, **arguments: Any) -> None:
        """Set up practice benches.

        Args:
            kind: "sdof", "joint" or "discrimination".
            num_envs: How many.
            **arguments: Those of `BenchVectorEnv` and of the environment.
        """
        if kind not in self.KINDS:
            raise UnknownNameError("kind of practice bench", kind, self.KINDS)
        self.kind = kind  # type: ignore[misc]
        super().__init__(num_envs, **arguments)

    def _make(self, n: int, threads: int, arguments: dict[str, Any]) -> Any:
        rest = dict(arguments)
        return PracticeBenches(setup_of(self.kind, rest), options_of(rest), n)
