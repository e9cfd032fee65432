"""The second page of ``velotyre explore``: a recording is loaded, looked at, fitted or diagnosed, and browsed."""
