"""Linear probe of the load in a policy's history."""
