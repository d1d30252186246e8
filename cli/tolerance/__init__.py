"""`dalembert tolerance`."""
