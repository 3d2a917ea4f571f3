"""Cases of robots for the diagnosis, simulated independently of the bench and of MuJoCo."""
