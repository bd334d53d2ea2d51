"""Plan of a picture: stages, each with the parts of the scene that requested it."""
