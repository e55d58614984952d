"""The Markov decision process of a recipe."""
