"""What runs for a picture: stages, each with the lines of the scene that requested it."""
