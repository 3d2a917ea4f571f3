"""Effects that can explain a discrepancy: force laws, sensor and actuator effects, and the nonparametric ones."""
