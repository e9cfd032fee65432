"""Does the packaged data say what the paper says?"""
