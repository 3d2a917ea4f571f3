"""Where commands write."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

Out = Annotated[Path, tyro.conf.arg(aliases=["-o"])]
"""File or folder to write, also asked for by ``-o``."""

PRINTED = Path("-")
"""A file of this name stands for standard output."""
