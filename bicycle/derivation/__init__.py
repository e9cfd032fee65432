"""From effects to equations: the symbolic model, closed and evaluated."""
