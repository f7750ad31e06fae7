"""Which effects are worth a fit: what a small one would make of the error of a model."""
