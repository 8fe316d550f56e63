"""Which reference picture of a street a query shows."""
