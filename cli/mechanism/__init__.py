"""The parts of `dalembert mechanism`: which inputs, which quantities, and how they are shown."""
