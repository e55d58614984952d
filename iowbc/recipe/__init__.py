"""What a recipe may say, and how it is loaded. Light: imports nothing else of the package."""
