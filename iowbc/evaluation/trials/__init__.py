"""Trials: planning, rollout and metrics."""
