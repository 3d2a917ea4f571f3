"""Records run again in plain MuJoCo with the user's own options, before and after what was found is put in."""
