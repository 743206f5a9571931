"""Memory of numpy in small pages: of the images that light is added up in most places stay zero and are never touched.

NumPy asks Linux for huge pages, of 2 MB, for arrays of 4 MB and more; a few lit pixels in each then cost the clearing
of all of it. In pages of 4 kB the sample at 5 Mpx takes 0.95 GB in place of 1.2, and a second of the processor less.
"""

from __future__ import annotations

import os
import sys

VARIABLE = "NUMPY_MADVISE_HUGEPAGE"
"""Of the environment, which NumPy reads when it is imported; one who sets it decides."""


def use_small_pages() -> None:
    """For all arrays of this process, and of those that it starts, from now on."""
    if VARIABLE in os.environ:
        return
    os.environ[VARIABLE] = "0"
    # there is no public name for what NumPy has read already
    switch = getattr(sys.modules.get("numpy._core.multiarray"), "_set_madvise_hugepage", None)
    if switch is not None:
        switch(False)
