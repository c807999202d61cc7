"""Measures: the error of a picture compared with the true one, and the cost of a kernel."""
