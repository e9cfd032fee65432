"""From a folder of recordings to conditions, a tyre map, tables and figures."""
