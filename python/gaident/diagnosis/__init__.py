"""What a record says beyond the linear model: evidence, causes, extended models, next experiments."""
