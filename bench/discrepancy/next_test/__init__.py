"""The test to run next: what would tell the rivals apart, within the limits of the bench."""
