"""Georeferenced maps: one file per way in which a map is described, all brought to `GeoMap`."""
