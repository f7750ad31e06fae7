"""Frequency responses: what a record shows of one, and models found from measured ones."""
