"""Controllers that others trained: their own configuration, and how they take part in the trials."""
