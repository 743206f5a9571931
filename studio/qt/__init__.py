"""The desktop: windows, panels and the 3D viewport over one document."""
