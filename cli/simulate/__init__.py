"""`dalembert simulate`."""
