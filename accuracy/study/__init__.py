"""Studies of the cost of accuracy: a scene rendered with many settings, against a reference of known error.

`Study` renders and resumes, `results` collects one document, `report` presents it.
"""
