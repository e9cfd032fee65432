"""The front frame from published figures: a magazine's stiffness of head tube and fork, or a laboratory's deflection."""
