"""What a residual is worth: the noise of the residuals, its whitening, and the prior."""
