"""Games of trained skills and of rivals, their tables and figure."""
