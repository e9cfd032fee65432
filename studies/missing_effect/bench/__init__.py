"""Bench tests of the steering of a bicycle at rest: torque at the bar against steer angle and rate."""
