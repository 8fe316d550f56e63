"""Networks with the weights that their authors published: comparison rows, whose weights do not ship."""
