"""Writes the controller that a robot runs: graph, contract, golden vectors."""
