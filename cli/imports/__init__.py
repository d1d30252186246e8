"""`dalembert import`: a mechanism drawn in another program becomes a description of ours."""
