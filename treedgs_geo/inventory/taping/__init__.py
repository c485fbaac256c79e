"""Which trees to tape, the form for the field, and what the tapes say of the measured diameters."""
