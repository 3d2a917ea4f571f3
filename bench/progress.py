"""How a long computation tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

ShowProgress = Callable[[str, float], None]
"""Called with what is being done and the share of the whole that is done."""
Tell = Callable[[str], None]
"""Called with what is being done."""
