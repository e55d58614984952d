"""Trials: plan, play and measurement."""
