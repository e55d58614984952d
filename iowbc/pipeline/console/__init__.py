"""The terminal of a run."""
