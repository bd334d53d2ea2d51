"""How surfaces answer light."""
