"""Laser light that goes straight to a surface and from there to the camera."""
