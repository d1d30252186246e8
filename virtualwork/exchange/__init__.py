"""Mechanisms from and for other programs: their drawings in (`programs`), drawings, curves and robots out (`export`).

A reader fills a `Drawing` (`drawn`); `settled` finds its mechanisms, `description` writes their TOML. A writer of robots
takes the `Skeleton` of a mechanism.
"""
