"""Where a result comes from: versions of the software that took part, and what the caller adds."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

SOFTWARE = ("jointbench", "mujoco", "numpy", "scipy", "numba")
"""Distributions whose versions can change a number."""


@cache
def software_versions() -> tuple[tuple[str, str], ...]:
    """Names and versions of Python and of the installed distributions in `SOFTWARE`, read without importing them."""
    found = [("python", platform.python_version())]
    for name in SOFTWARE:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:  # jointbench itself, run from a source tree that was never installed
            found.append((name, "unknown"))
    return tuple(found)


def provenance(*, timed: bool = False, **extra: Any) -> dict[str, Any]:
    """The provenance of a result, for `Recording.meta` and JSON reports.

    Args:
        timed: Add the present time (UTC, ISO 8601, to the second) as "created". Off by default: two runs of the same
            thing then give the same record, bit by bit.
        **extra: JSON values of the caller: name of the rig, its elements, seed, ….

    Returns:
        ``{"versions": {"jointbench": …, …}, **extra}``.
    """
    entries: dict[str, Any] = {"versions": dict(software_versions())}
    if timed:
        entries["created"] = datetime.now(UTC).isoformat(timespec="seconds")
    return entries | extra
