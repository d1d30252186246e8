"""`dalembert balance`: rotors whose eccentric masses are known."""
