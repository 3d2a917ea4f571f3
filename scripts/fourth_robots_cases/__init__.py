"""Cases of a fourth author's robots for the diagnosis, simulated without the bench and without MuJoCo."""
