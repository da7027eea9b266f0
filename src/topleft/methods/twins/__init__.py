"""Twins in Python of the classics and of the production walkers, written for reading.

A twin draws the pixels of its kernel in `topleft.methods.classics`, and tells a recorder of its steps.
"""
