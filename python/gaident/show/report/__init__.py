"""The report: one self-contained HTML page, a pure function of a result and of what was worked out of its records."""
