"""The blind test: a generator that is not the fitter, cases, scores and report."""
