"""Rules over the spec and its graph: `families/` holds them, the modules here run and explain them."""
