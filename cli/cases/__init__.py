"""What all commands on a mechanism share: its cases, each a variant at its inputs, and the options that make them."""

FILE = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
"""
CASES = """
Which poses, which mechanism:
  at INPUT...  Pose: 60deg, 20mm, crank=60deg,arm=30deg; repeatable.
  over RANGE...  Range of the input, 0deg:360deg:1deg or 0deg:360deg/360; of any input or dimension, NAME=FROM:TO:STEP; repeatable.
  cases FILE.csv  Table with a row for each case, a column for each input or dimension (crank_deg, t_s, links.crank.B.x_mm).
  set NAME=VALUE...  Change a dimension: links.crank.B.x=62mm; repeatable.
"""
BRANCH = """
  branch all|NUMBER  Every assembly, or one (default: that of the guess).
"""
WORKERS = """
  workers N  Number of processes for many variants.
"""
