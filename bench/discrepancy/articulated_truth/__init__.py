"""Robots as they really are: articulated bodies with something withheld from the model, for sealed cases."""
