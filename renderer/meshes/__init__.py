"""Mesh files: OBJ, PLY and glTF."""
