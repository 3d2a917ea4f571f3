"""Reading and writing records: one lossless format of our own, and the laboratory's formats with a small column map.

Parquet is the format of the bench: exact to the bit, with channels, units, provenance and a checksum inside, and
readable by any data tool. CSV, MAT, npz and HDF5 files are read, never written.
"""

from bench.record_files.column_map import ColumnMap
from bench.record_files.parquet import FORMAT_VERSION, write_recording
from bench.record_files.reading import READABLE, read_recording

__all__ = ["FORMAT_VERSION", "READABLE", "ColumnMap", "read_recording", "write_recording"]
