"""The ground: kinds of numbers, and what keeps their digits.

`exact`: sums and products with their rounding errors; `doubled`: numbers of twice as many digits. Each is imported
by its own name, so that nobody loads more than he uses.
"""
