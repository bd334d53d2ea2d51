"""Which light points are hidden from which points, decided without any length to step over."""
