"""Forward models and files of the tyre rig: tables of two surfaces, raw recordings."""
