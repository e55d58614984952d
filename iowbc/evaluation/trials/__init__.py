"""Which trials there are, and how they are played and measured."""
