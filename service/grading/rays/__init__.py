"""Tests of ray tables: hits compared with those of this renderer, and the mistake behind wrong ones."""
