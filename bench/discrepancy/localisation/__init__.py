"""Where the discrepancy lies: the missing force without any law, its regions of the state, bands, times, and faults of sensors."""
