"""The embedded street: a seeded, endless street of textured planes, seen by a car's cameras with exact geometry.

Street frame: metres, x to the right, y down, z along the street; the road is the plane y = 0.
"""
