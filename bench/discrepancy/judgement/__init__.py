"""From fits to a verdict: posterior, predictive checks, the discrepancy on validation records."""
