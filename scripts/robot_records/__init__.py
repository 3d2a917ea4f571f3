"""Public records of robots as cases of the diagnosis."""
