"""Figures of labels, fit and postures."""
