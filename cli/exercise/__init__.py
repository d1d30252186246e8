"""`dalembert exercise`: variants of an exercise for every student, their sheets, key and solutions."""
