"""`ghst bench`: measures the firmware on the emulated chip, and writes docs/figures.md.

What is measured on the emulated chip is measured in emulated time and is the same in every run.
"""
