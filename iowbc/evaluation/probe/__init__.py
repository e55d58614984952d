"""What a policy's history knows of the load: a linear probe of its latent."""
