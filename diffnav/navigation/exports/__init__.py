"""Fixes for other programs: GeoJSON, GPX, NMEA sentences, and a map that opens in a browser without a network."""
