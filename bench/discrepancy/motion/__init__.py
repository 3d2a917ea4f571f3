"""Motion from records: the Kalman smoother, measured coordinates and prescribed motion."""
