"""Identification: from records to models.

One module a method, each usable on arrays: `restoring_force` (a joint's forces from loads, inertia and mounts),
`polynomial` and `network` (models of a joint's states), `parametric` (a law's parameters, hidden states included),
`surface` (restoring-force surfaces), `adaptive` (least squares on line), `damper` (design model and order study).
`bench.reduction` turns their results into elements.
"""
