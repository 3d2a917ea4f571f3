"""The cases of the fifth laboratory: their physics, their integration, their loggers, and what is right of each."""
