"""Where the laser line is in an image."""
