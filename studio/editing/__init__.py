"""What a person edits: forms, units, presets, placement."""
