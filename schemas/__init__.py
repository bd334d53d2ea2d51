"""The language of scenes, jobs, tiles, plans and problems."""
