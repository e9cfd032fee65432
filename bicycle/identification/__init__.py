"""From a recorded motion to modes and coefficient matrices."""
