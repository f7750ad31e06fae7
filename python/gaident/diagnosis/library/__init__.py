"""The library of effects as a diagnosis sees them: terms, kin, equivalence classes. No other room names an effect."""
