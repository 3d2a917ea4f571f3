"""The groups of `scripts/benchmark.py`: each module's `rows(repeats)` runs its measurements side by side."""
