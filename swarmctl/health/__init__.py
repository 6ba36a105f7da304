"""What the swarm should look like, what its hosts say, and what the difference means."""
