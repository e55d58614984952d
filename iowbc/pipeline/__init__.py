"""Runs a recipe: keys, store, plan, locks, tracking, console. Nothing heavy is imported before a stage needs it."""
