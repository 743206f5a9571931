"""Frames as files: OpenEXR layers, sidecars, tone mapping."""
