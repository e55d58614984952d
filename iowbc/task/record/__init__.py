"""Signals and counters recorded in each step."""
