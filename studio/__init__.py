"""The program without its windows: project file, jobs, the scan pipeline."""
