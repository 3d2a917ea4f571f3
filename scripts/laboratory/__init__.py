"""Cases as a laboratory has them: how they are integrated and written down."""
