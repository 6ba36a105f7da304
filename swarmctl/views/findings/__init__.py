"""What ``validate`` found, one module a format: pure functions from a ``Report`` to text."""
