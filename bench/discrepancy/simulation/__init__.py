"""Time integration: stick-slip systems, linear and prescribed responses."""
