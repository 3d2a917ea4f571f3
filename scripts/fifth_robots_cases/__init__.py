"""Cases of a fifth author's robots for the diagnosis, simulated without the bench and without MuJoCo."""
