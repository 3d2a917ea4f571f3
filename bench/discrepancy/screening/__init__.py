"""Which effects are worth a fit: projections of the residual, score tests, linear amplitudes."""
