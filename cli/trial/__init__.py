"""`dalembert trial`: a trial mass for the first run."""
