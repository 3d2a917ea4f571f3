"""The blind protocol: sealed cases, made by integrators of their own, and the scoring of what was said about them."""
