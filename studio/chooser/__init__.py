"""Trains the network that chooses the line among a row's peaks, on scenes of a recipe."""
