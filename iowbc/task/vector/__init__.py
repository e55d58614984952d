"""Many environments over worker processes, as a vector environment."""
