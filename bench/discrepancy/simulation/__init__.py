"""Time integration: steps, stick-slip systems, linear and prescribed responses."""
