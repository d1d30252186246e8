"""`dalembert mechanism`."""
