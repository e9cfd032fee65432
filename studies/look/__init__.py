"""What a recording holds, what each command would make of it, and what is lacking: ``velotyre look``."""
