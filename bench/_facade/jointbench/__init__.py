"""jointbench: a MuJoCo virtual test bench for nonlinear joints.

The public names of `bench` under the name that the project is installed by, imported when first used; its packages likewise:
``from jointbench.discrepancy import diagnose`` is the function of `bench.discrepancy`, no second one. A `bench` or `envs` of the
user's own, in the folder a program is run from, is not taken for the bench's.

Example:
    >>> import jointbench
    >>> rig = jointbench.sdof_rig(jointbench.Element.of("gap", "carriage", stiffness=2000.0))  # doctest: +SKIP
"""

from __future__ import annotations

from jointbench._own import follow, own

TYPE_CHECKING = False  # `typing` would be imported whenever Python starts
if TYPE_CHECKING:
    from typing import Any

    from bench import *  # noqa: F403

follow()


def __getattr__(name: str) -> Any:
    if name.startswith("__") and name not in {"__all__", "__version__"}:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    bench = own("bench")
    if not hasattr(bench, name):
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(bench, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *dir(own("bench"))})
