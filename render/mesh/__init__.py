"""Triangle meshes: read from files, made from numbers, textured, checked for being watertight."""
