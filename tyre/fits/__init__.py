"""From one recording to cornering stiffness, lateral stiffness or relaxation length, with uncertainty."""
