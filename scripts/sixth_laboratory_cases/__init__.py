"""The cases of the sixth laboratory: their physics, their integration, their loggers, and what is right of each."""
