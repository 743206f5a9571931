"""What every room of the renderer stands on: errors, files, models, poses, threads, progress, kernel cache."""
