"""Camera positions: MRK, RTKLIB .pos, EXIF/XMP -> one station per photo."""

from .reading import read_stations
from .stations import Stations, read_stations_layer, write_stations

__all__ = ["Stations", "read_stations", "read_stations_layer", "write_stations"]
