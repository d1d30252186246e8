"""`dalembert grade`: the marks of answers to an exercise."""
