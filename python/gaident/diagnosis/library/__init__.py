"""The library of effects as a diagnosis sees them: terms, families, equivalence classes. No other room names an effect."""
