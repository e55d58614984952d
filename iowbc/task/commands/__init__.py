"""Where commands come from: drawn in training, scripted in trials."""
