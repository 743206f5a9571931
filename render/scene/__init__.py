"""The description of what is there: objects, lamps, motion, and how it shall be rendered."""
