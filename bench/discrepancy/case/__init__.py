"""A case: nominal parameters and records as read from a folder, their units, and how they were acquired."""
