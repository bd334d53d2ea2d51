"""Which light points are hidden from which points, decided without an epsilon."""
