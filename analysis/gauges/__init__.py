"""Dimensions of a part from its profile in the plane of a laser, each with its sigma."""
