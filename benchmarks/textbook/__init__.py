"""The formulas of the textbooks in float32, each as a stage that takes the place of one of Penumbra's.

They are what a picture costs where nothing is done about rounding. So they are written with care for speed:
arrays are structures of arrays, pair work goes through the buffers of the workspace, what the points or rays
of a block share is formed once, and shapes that a block cannot hit are left out, all as in the renderer.
"""
