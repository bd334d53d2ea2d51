"""Where pixels and textures lie: finished tiles, final pictures, uploaded assets."""
