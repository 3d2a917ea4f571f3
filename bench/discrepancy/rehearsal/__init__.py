"""The day in the laboratory before it happens: what would be found with these signals, and which signals would find more."""
