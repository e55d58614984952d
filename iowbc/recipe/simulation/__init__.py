"""Physics, scenes, partner, randomisation and sensors of a recipe."""
