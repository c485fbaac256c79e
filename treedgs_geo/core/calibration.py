"""What diameters and their errors rest on, in the words of help, report and docs."""

#: Of every route.
CALIBRATION = (
    "Errors and limits were calibrated on rendered and simulated plots, mostly pines; no photo of a tree that somebody "
    "taped has been measured yet."
)
#: Of photos too.
NETWORK = "A network trained on TreeDGS's own simulator decides which pixels show stems and which ivy."
#: What to do about it.
TAPE = "Tape some trees: they say how right the diameters are."
