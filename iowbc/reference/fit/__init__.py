"""Fits the reference generator to its labels, and judges it."""
