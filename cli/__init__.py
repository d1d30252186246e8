"""The `dalembert` command: reads tables, calls the three packages, shows the result."""
