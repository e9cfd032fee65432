"""A fitted campaign as report, figures and files."""
