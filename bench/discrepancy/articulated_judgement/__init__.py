"""What records that chose nothing say of an explanation of an articulated model: predictions, and what is left of them."""
