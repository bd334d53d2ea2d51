"""A ray tracer on NumPy arrays that runs only what a scene calls for."""
