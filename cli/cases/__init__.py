"""What all commands on a mechanism share: its cases, each a variant at its inputs, and the options that make them."""

FILE = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
"""
_OVER_CASES = """
  over RANGE...  Range of the input, 0deg:360deg:1deg or 0deg:360deg/360; of any input or dimension, NAME=FROM:TO:STEP; repeatable.
  cases FILE.csv  Table with a row for each case, a column for each input or dimension (crank_deg, t_s, links.crank.B.x_mm).
"""
_SET = """
  set NAME=VALUE...  Change a dimension: links.crank.B.x=62mm; repeatable.
"""
CASES = f"""
Which poses, which mechanism:
  at INPUT...  Pose: 60deg, 20mm, crank=60deg,arm=30deg; repeatable.
{_OVER_CASES}{_SET}"""
RANGES = f"""
Which range, which mechanism:
  at INPUT...
{_OVER_CASES}{_SET}"""
"""Options of a command that searches a range of the input: it refuses --at by a message of its own."""
VARIANTS = f"""
Which mechanism:
  at INPUT...
  over RANGE...  Range of a dimension: NAME=FROM:TO:STEP; repeatable.
  cases FILE.csv  Table with a row for each variant, a column for each dimension (links.crank.B.x_mm).
{_SET}"""
"""Options of a command that has no single pose."""
BRANCH = """
  branch all|NUMBER  Every assembly, or one (default: that of the guess).
"""
WORKERS = """
  workers N  Number of processes for many variants.
"""
