"""Sparse images take memory where they are written to, whoever imported NumPy first."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from render.base.small_pages import VARIABLE

PROGRAM = """
import {first}, {second}
import numpy as np

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

image = np.zeros(1 << 25, np.float32)
before = resident()
image[:: 1 << 19] = 1.0
print(resident() - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="pages are those of Linux")
@pytest.mark.parametrize("imports", [("numpy", "studio.project.project"), ("studio.project.project", "numpy")])
def test_a_sparse_image_takes_memory_only_where_it_is_lit(imports: tuple[str, str]) -> None:
    """64 pixels in 128 MB: of huge pages all of it would be taken."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    program = PROGRAM.format(first=imports[0], second=imports[1])
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 1 << 22
