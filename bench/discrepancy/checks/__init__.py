"""Checks of the records before any fit: data quality, initial motion, quantisation."""
