"""The effects of the rig, one per file; the file's name is the effect's identifier. Found, not listed."""
