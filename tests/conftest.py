"""Every run of the tests is the same run: property tests draw from a fixed seed and never fail for being slow."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None, print_blob=True)
settings.load_profile("repeatable")
