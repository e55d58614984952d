"""Stages on Ray: the nodes compute, the driver alone stores and records."""
