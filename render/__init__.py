"""What is there and what light does: scene model, exact truth, light transport, sensor."""

import os

from render.base.kernel_cache import keep_kernels

# what OpenCV says of a damaged image on its own is told in a message of ours
os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
keep_kernels()
