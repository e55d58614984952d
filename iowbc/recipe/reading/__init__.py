"""From a YAML file to a validated recipe, and back."""
