"""Whether a submitted picture shows noise of its own: signals for staff that it was made from another."""
