"""`dalembert spin`: the rotation of a body in time."""
