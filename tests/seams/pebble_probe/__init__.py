"""The on-robot half of the toy middleware: what its package puts into the agent. Python 3.8."""
