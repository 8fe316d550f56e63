"""What the embedded world is made of: noise, layout, ground, roads, buildings, trees."""
