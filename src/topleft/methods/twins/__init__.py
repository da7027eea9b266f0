"""Twins in Python of the classics, written for reading.

A twin draws the pixels of its kernel in `topleft.methods.classics`.
"""
