"""The placed scene as arrays and a ray engine: what a ray hits, and what is there."""
