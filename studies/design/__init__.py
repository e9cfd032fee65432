"""The smallest change of a model that keeps named modes stable over a range of speed."""
