"""What could not be named is kept: a torque without a cause, fitted to what remains, with its uncertainty."""
