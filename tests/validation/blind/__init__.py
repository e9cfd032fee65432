"""Blind test: hides effects in synthetic measurements made by other equations, diagnoses and scores them."""
