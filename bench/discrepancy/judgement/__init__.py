"""Judgement: from fitted explanations to what is said, and how sure."""
