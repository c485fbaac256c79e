"""Instruments that judge the rest: speed against accuracy, stability where methods fail, what work costs."""
