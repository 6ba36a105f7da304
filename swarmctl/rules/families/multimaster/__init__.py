"""Rules: multimaster."""
