"""A simulated robot on the bus of the real one."""
