"""Uncertain inputs carried to modes and critical speeds."""
