"""`dalembert examples`: the worked examples."""
