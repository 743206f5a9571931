"""What is there and what light does: scene model, exact truth, light transport, sensor."""

from render.kernel_cache import keep_kernels

keep_kernels()
