"""What is there and what light does: scene model, exact truth, light transport, sensor."""

from render.base.kernel_cache import keep_kernels

keep_kernels()
