"""What a deploy costs, step by step."""
