"""What travels between a client and the service: requests, jobs, plans, tiles and answers about them."""
