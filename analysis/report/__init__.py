"""One self-contained report of a scan, HTML and PDF."""
