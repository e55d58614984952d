"""Model-based baseline: whole-body control by a quadratic program, without a learnt policy."""
