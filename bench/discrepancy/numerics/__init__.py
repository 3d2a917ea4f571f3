"""Numerics of the diagnosis without mechanics: threads, cubic splines, least squares, spectral products."""
