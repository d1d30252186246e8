"""What the program costs and how far it is right: `python -m benchmarks`, in a checkout; no part of what is installed.

`speed` run time against error, `stress` random campaigns at singular places, `fuzz` damaged inputs, `truth` the answers
of many digits that all of them and the tests compare with, `peers` the same work with other packages.
"""
