"""The software that the bytes of a campaign depend on."""

from __future__ import annotations

from collections.abc import Mapping

from bench.provenance import software_versions

BYTES_DEPEND_ON = ("jointbench", "mujoco", "numpy", "scipy", "numba", "pyarrow")
"""Distributions that must be the same on all workers, and when a campaign is resumed."""


def versions() -> dict[str, str]:
    """Versions of what the bytes of a campaign depend on, and of Python."""
    from importlib.metadata import version  # noqa: PLC0415

    return {**dict(software_versions()), "pyarrow": version("pyarrow")}


def differing(other: Mapping[str, str], own: Mapping[str, str], word: str = "here") -> str:
    """Versions that would make other bytes than our own, as a list to read; empty where there are none.

    Args:
        other: The versions of another worker, or of another time.
        own: Our versions.
        word: What ours are: those "here", those of "now".
    """
    return ", ".join(
        f"{name} {other.get(name)} ({word} {own[name]})"
        for name in BYTES_DEPEND_ON
        if name in own and other.get(name) != own[name]
    )
