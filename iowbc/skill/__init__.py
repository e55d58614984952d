"""The Markov game of a robot and a human who transport an object, on top of a frozen controller."""
