"""What moves a mode most."""
