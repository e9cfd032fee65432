"""Tables, figures and words that all studies share."""
