"""What `velotyre modal` shows of free decays: pictures and the sd of repeats in words."""
