"""A person on a bicycle: measured or scaled body, seated posture, and the rear frame with rider as one rigid body."""
