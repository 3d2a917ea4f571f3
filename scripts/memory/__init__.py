"""Joints with memory against their rivals: one module a task, each with `rows(progress)`."""
