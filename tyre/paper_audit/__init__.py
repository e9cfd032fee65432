"""The source paper's claims against its own tables."""
