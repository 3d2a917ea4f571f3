"""From fits to a verdict: posterior, predictive checks, what is named."""
