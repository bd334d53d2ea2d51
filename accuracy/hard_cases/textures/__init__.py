"""Hard cases G: textures, normal maps and displacement."""
