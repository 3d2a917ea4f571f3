"""The cases of the fourth laboratory: their physics, their integration, their loggers, and what is right of each."""
