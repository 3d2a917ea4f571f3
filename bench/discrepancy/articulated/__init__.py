"""Articulated models: arms, legs and servos, diagnosed joint by joint along the measured motion."""
