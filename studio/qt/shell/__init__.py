"""The window itself: application, panels, workspaces, files, help."""
