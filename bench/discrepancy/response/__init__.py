"""From a parameter vector and a record to channels: the loads that drive a free run."""
