"""Fits of given sets of effects: where they begin, maximum a posteriori, which have been made, and initial states."""
