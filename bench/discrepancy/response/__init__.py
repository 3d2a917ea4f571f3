"""From a parameter vector and a record to channels: step size, driving loads."""
