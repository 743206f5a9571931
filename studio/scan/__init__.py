"""From a project to results: frames, line, points, report, and the folder they are in."""
