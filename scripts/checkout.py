"""Which code gave a result."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def commit() -> str:
    """Hash of the checkout, marked where it holds changes; "unknown" where it is none, as in an unpacked archive."""
    try:
        told = subprocess.run(
            ("git", "describe", "--always", "--dirty"), cwd=ROOT, capture_output=True, text=True, check=False
        )
    except FileNotFoundError:  # no git
        return "unknown"
    return told.stdout.strip() or "unknown"
