"""What the images tell: line extraction, triangulation, error, report."""

import render  # noqa: F401 - it says where compiled kernels are kept, before any is made
