"""What is there and what light does: scene model, exact truth, light transport, sensor."""

import os

from render.base.kernel_cache import keep_kernels
from render.base.small_pages import use_small_pages

# what OpenCV says of a damaged image on its own is told in a message of ours
os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
# of every type that an operation does not take numba colours a message that nobody reads
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
use_small_pages()
keep_kernels()
