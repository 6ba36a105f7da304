"""What nodes of several packages use. Each package that needs it lands on a host with a copy beside it."""
