"""Fit of the reference generator to its labels, and its evaluation."""
