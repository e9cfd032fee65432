"""What the whole house stands on: errors, paths, files, notes, progress, parallel work."""
