"""The Markov decision process: commands, references, observation, reward, curriculum and the vector environment."""
