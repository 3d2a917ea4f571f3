"""The cases of the third laboratory: their physics, their integration, their loggers, and what is right of each."""
