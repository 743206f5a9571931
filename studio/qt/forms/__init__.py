"""Fields and forms made from models."""
