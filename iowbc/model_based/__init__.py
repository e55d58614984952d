"""The model-based rival: whole-body control by a quadratic program, without anything learnt."""
