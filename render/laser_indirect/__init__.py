"""Laser light over several surfaces: bidirectional path tracing, guiding, manifold walks, photon merging."""
