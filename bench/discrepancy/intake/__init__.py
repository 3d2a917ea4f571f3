"""Logs and a model brought into the form of a case: columns matched by name, uncertainties by stated defaults."""
