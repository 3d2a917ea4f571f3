"""What an articulated model may lack: the catalogue, the statistical problem of its records, screening, fits and search."""
