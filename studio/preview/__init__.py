"""What is seen before anything is rendered: preview, read-outs, estimates."""
