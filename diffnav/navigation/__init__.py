"""From a camera picture to a place on a georeferenced map, or a reasoned "no fix"."""
