"""`dalembert forces`."""
