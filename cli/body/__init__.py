"""`dalembert body`: a body put together from parts, and its motion."""
