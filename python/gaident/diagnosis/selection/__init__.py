"""The selection of a model: a beam search over mechanisms and effects, one criterion, one decision."""
