"""Documents between client and service: requests, jobs, plans, tiles and results."""
