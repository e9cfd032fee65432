"""Numbers of a model file that are run or varied together: speed, any parameter, tyre pressure or load."""
