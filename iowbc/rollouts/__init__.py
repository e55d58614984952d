"""Rollouts made where the environments are: policies in NumPy, what drives with them, what is recorded."""
