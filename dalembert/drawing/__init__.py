"""Common parts of pictures: the sheet, units with their prefix, labels that keep clear, polar dials, curves.

matplotlib is imported by the functions that draw; whoever draws nothing never loads it.
"""
