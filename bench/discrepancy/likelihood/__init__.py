"""The likelihood of records: what residuals a model leaves, and how much each of them counts."""
