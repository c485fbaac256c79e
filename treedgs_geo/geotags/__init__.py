"""Camera positions: MRK, RTKLIB .pos, EXIF/XMP -> one station per photo."""
