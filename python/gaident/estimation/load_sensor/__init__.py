"""A sensor at the load: what models make of its signal, and fits to motor and load together."""
