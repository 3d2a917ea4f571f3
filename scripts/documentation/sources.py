"""Which modules are public, found by their files; nothing is imported."""

from __future__ import annotations

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
