"""Lines of several images: exposures, laser on and off, space-time."""
