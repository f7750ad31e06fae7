"""The records of a diagnosis: what it is given, outliers, steps of a quantised signal, folded turns."""
