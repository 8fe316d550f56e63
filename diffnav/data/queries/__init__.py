"""Pictures to be located: folders with or without truth, and pictures cut from maps, all brought to `Query`."""
