"""The rules: one module a family, found by its name, with the YAML file that explains them."""
