"""A command killed at a moment, with all that it started."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence


def killed(command: Sequence[str], seconds: float) -> bool:
    """Whether it was killed after so long; False: it came to its end before."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        process.wait(timeout=seconds)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True
