"""The seven steps of a scan as functions of a project, for a notebook or a script: `import studio as blazer`."""
