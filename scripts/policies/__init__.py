"""Experiments with excitation policies: what a reward is worth, training, evaluation."""
