"""The database, the only durable truth: jobs, their tiles, and uploaded assets."""
