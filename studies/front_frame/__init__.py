"""The front frame from published figures: stiffness of head tube and fork, or a deflection at the ground."""
