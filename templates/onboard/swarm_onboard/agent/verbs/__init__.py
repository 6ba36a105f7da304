"""The requests that a host answers: one module per verb."""
