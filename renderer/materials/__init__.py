"""Materials: how surfaces reflect and transmit light."""
