"""The type of arrays of real numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double precision, of any shape; docstrings tell the shape."""
