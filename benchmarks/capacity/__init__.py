"""How far one database and one dispatcher go: the service's own decisions, on a cluster that is simulated."""
