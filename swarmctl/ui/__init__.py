"""The page of ``swarmctl ui``: looks at the hosts while a page is open, and the local server."""
