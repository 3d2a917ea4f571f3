"""Search over sets of effects: forward selection, multistart, elimination, rivals."""
