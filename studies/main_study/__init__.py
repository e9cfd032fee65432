"""The main study: measured racing tyres on a bicycle, its figures, tables and report."""
