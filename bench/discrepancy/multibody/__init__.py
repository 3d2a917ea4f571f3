"""An articulated MJCF along a measured motion: inverse dynamics, drives, encoders, and runs of one joint at a time."""
