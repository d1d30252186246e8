"""`dalembert fit`."""
