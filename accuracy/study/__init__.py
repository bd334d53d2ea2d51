"""The cost of accuracy in time: a scene rendered with many settings, against a reference of known error.

`Study` renders and resumes, `results` makes one document of what was found, `report` writes it up.
"""
