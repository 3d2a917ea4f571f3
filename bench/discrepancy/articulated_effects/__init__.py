"""Effects that an articulated model may lack, at joints, drives, bodies and encoders, and what is placed where."""
