"""The page of ``velotyre explore``: controls, linked figures, downloads; every number comes from the library."""
