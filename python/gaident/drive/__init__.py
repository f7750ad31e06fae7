"""A drive's file (TOML): its log, controller, units and limits, read and drafted."""
