"""`dalembert engine`: shaking forces of engines of several cylinders."""
