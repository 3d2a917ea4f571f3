"""The truth of sealed cases: rigs, withheld effects, and an integrator that the fits do not use."""
