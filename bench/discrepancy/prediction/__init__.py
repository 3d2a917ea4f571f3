"""What explanations predict of records that they were not fitted to, and what they leave of them."""
