"""Trees of boxes that find the few shapes a ray may hit."""
