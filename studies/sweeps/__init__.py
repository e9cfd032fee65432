"""Sweeps over grids and samples of models, the same bits on any engine."""
