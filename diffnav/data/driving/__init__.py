"""Street pictures of two cameras of one car, of which one camera's are found again among the other's."""
