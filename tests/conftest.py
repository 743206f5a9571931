"""Every run of the tests is the same run: property tests draw from a fixed seed and never fail for being slow.

A shell has the programs that it starts in the background ignore Ctrl-C, and their own programs with them: here it is
heard, so that tests of it mean the same however they were started.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None, print_blob=True)
settings.load_profile("repeatable")

# Else every module is compiled anew, by each of the test's processes and by all programs that they start.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Collecting leaves no garbage worth the search.
gc.disable()

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def quick_reports() -> Iterator[None]:
    """See tests/quick_reports.py."""
    from tests.quick_reports import drawn_quickly

    with drawn_quickly():
        yield


def pytest_collection_finish() -> None:
    """What collecting made lives to the end: no search for garbage needs to look at it again."""
    gc.freeze()
    gc.enable()
