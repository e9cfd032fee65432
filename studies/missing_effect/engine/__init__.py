"""The search itself: fits, evidence, checks, what cannot be told apart, the verdict. Knows only forward models."""
