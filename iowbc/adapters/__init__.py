"""Adapters for third-party controllers: their configuration, and their use as policies in the trials."""
