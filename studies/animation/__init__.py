"""Motion as film and figure."""
