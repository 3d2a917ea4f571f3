"""Measured records as cases for the diagnosis: one module a source, each with `cases(data)`."""
