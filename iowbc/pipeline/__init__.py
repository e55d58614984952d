"""The staged runner: plan, keys, artifact store, locks, tracking and console."""
