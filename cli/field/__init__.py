"""`dalembert field`: rotors whose vibration was measured, with trial masses."""
