"""Rig recordings: reading, writing, units, axis conventions and the pre-flight check."""
