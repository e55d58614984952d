"""The contents of a recipe, and its loading. Light: imports nothing else of the package."""
