"""`dalembert signal`: amplitude and phase of a recorded vibration."""
