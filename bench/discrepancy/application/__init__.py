"""From a verdict to the user's own model: every named effect in MuJoCo's own terms."""
