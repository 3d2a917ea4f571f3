"""Fits of given sets of effects: maximum a posteriori, and initial states."""
