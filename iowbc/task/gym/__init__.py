"""A single environment as a `gymnasium.Env`."""
