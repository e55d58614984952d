"""Sources of commands: random in training, scripted in trials."""
