"""Whether a picture shall be enhanced before it is matched: the paper's gate, one that asks what enhancement gains."""
