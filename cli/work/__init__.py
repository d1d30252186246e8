"""`dalembert work`: the unknown load of a table of link states."""
