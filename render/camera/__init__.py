"""The camera: projection, distortion, thin lens, focus, and the rays of its pixels."""
