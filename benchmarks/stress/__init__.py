"""Seeded random campaigns at singular places: the true error against the bound that the program itself gives."""
