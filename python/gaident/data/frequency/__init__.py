"""Measured frequency responses, and their text files."""
