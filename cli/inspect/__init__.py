"""`dalembert inspect`."""
