"""The reference generator: optimal control problem, dataset and network."""
