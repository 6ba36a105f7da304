"""Values to text: one module an output. Prints nothing by itself, opens nothing."""
