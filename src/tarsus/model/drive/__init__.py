"""Drives: waveforms [V], laws from volts to force [N], and their lowering to polynomials of time."""
