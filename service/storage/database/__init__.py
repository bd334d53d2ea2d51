"""The one durable truth: jobs, their tiles, and the textures uploaded for them."""
