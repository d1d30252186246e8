"""Formulas of the books that need no mechanism: combinations of motion, tables of link states."""
