"""The project file: its schema, versions, templates, meshes, autosave."""
