"""`dalembert equilibrium`."""
