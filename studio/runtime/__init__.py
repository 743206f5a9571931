"""What runs beside the work: jobs, preferences, error messages, the system's libraries."""
