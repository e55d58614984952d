"""What is written down of each step."""
