"""`dalembert export`: a mechanism for other programs: drawings, curves, robots."""
