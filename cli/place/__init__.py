"""`dalembert place`: a correction put where masses can go."""
