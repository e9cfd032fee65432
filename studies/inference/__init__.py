"""Which of many candidate parameters is missing from a model: knows numpy and scipy, and nothing of bicycles."""
