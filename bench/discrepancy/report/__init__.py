"""A diagnosis for people: the page, its pictures, the recording for the rerun viewer, and how to apply what was found."""
