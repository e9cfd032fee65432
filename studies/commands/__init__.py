"""One command of ``velotyre`` per file: the file's name is the command's name, ``command`` the click command."""
