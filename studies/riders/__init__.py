"""A rider on a bicycle: the picture, the words and the file."""
