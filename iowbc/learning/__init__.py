"""PPO set-up, networks, checkpoints and distillation."""
