"""Labels for the reference generator: what is sampled, solved, judged and kept."""
