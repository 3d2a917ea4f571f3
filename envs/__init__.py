"""Gymnasium environments of the bench."""
