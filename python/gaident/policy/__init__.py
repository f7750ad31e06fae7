"""The policy: the one table of numbers by which gaident decides about a model (`table.py`)."""
