"""What records can tell, before any fit: faults of the recording, and what of the model and of the catalogue they identify."""
