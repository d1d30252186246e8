"""`dalembert index`: index balancing."""
