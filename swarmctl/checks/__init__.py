"""Rules over the spec and its graph: one module a family, one function a rule. Pure."""
