"""Authentication: API keys, browser sessions, roles of users, and host names."""
