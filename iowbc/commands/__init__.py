"""What the user types: one file for each command."""
