"""Rollouts in the environments' processes: policies in NumPy, rollout policies and recorded trajectories."""
