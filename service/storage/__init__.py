"""Storage of pixels and assets: finished tiles, final pictures, uploaded textures and meshes."""
