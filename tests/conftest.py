"""Shared by all tests."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

# The workers of a run keep the cores busy: threads of linear algebra beside them, read at the first import, wait for each other.
for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

settings.register_profile("jointbench", deadline=None)  # what compiles on its first call takes a second
settings.load_profile("jointbench")


@pytest.fixture(autouse=True)
def _no_log_of_mujoco() -> Iterator[None]:
    """MuJoCo writes its warnings into the folder that one works in, unless the bench keeps them to itself."""
    log = Path.cwd() / "MUJOCO_LOG.TXT"
    before = log.stat().st_size if log.exists() else 0
    yield
    assert (log.stat().st_size if log.exists() else 0) == before, f"MuJoCo wrote a warning into {log}"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20061115)
