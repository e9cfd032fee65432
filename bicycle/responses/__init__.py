"""Motion in time and frequency."""
