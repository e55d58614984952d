"""Trials, metrics, tables, figures and videos."""
