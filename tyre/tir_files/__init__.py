"""Tyre property files (.tir) of MF5.2, MF6.1 and MF6.2."""
