"""Run time against error: what `dalembert bench` measures, one module per domain.

A domain's module has a function `measure(quick: bool)` that yields `Measurement`s. Errors are against answers
that were computed in extended precision and are stored beside this file (`references/`, made by
`benchmarks/make_references.py`), or against exact rational arithmetic; never against the program itself.
"""
