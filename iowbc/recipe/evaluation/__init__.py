"""Trials of the trained policy: which scenes, masses and commands, how often, and what counts as success."""
