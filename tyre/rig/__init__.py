"""A simulated rig: what it reads is synthetic."""
