"""Stages on Ray: nodes compute; only the driver writes to the store and to tracking."""
