"""Forward models and files of bicycle motion: modal data, time histories, identified coefficients."""
