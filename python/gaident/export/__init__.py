"""Out to the field's other tools: scipy.signal, python-control, pandas, C. Reached by the methods of models and results."""
