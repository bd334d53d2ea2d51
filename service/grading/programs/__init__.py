"""Mistakes that a program makes in all its pictures: found once, charged once, undone elsewhere."""
