"""Regressions whose solution needs no search and no simulation: inverse dynamics."""
