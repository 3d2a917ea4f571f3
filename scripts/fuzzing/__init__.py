"""Readers under mutated inputs: what they refuse has to be a `BenchError`, soon, in little memory, and leave nothing behind."""
