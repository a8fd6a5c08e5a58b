"""Files of vibrometers, recorders and oscilloscopes: one file a format, and the function that finds the right one.

What a file holds is the same for every reader: records, frequency responses, and the volts of a signal.
"""
