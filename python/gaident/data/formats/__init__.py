"""Readers of log formats: a file becomes a table of named columns."""
