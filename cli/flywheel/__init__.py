"""`dalembert flywheel`: a flywheel from a table of torque."""
