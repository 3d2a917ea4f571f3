"""A case: nominal parameters and records as read from a folder, their units, and how they were acquired."""

from bench.discrepancy.case.reading import read_case

__all__ = ["read_case"]
