"""The cases of the second laboratory: their physics, their integration, their test set-ups, and what is right of each."""
