"""What is there and what light does: scene model, exact truth, light transport, sensor."""
