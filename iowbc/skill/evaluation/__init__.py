"""Games of trained skills and baselines, their tables and figure."""
