"""Cases of a sixth author's robots for the diagnosis, simulated without the bench and without MuJoCo."""
