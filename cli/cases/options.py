"""The options that every command on a mechanism shares: which poses, which mechanism."""

from __future__ import annotations

from types import SimpleNamespace

FILE = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
"""
CASES = """
Which poses, which mechanism:
  at INPUT...  A pose: 60deg, 20mm or crank=60deg,arm=30deg; repeatable.
  over RANGE...  0deg:360deg:1deg or 0deg:360deg/360 of the input, NAME=FROM:TO:STEP of any input or dimension; repeatable.
  cases FILE.csv  Columns for inputs or dimensions (crank_deg, t_s, links.crank.B.x_mm), a row for each case.
  set NAME=VALUE...  Change a dimension: links.crank.B.x=62mm; repeatable.
"""
BRANCH = """
  branch all|NUMBER  Every assembly, or one of them.
"""
WORKERS = """
  workers N  Processes for many variants.
"""


class Options(SimpleNamespace):
    """The values of a command's own options, by their names."""
