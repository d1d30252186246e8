"""The ground: kinds of numbers, and what keeps their digits.

`exact`: sums and products with their rounding errors; `doubled`: numbers of twice as many digits, `doubled_functions`
their sine and its like; `arrays`: the functions of numpy's. `recorded`: numbers that write down what is done with them;
`tape`: what they write, as data; `adjoint`: its derivatives;
`engines`: what runs a tape. Each is imported by its own name, so that nobody loads more than he uses.
"""
