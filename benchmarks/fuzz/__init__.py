"""Broken input: worked examples with their files and options damaged at random, run by the real command."""
