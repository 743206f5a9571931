"""Laser light over several surfaces: bidirectional path tracing, guiding, photon merging."""
