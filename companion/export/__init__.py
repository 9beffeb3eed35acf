"""A flight's logs in other programs' files: tables (Parquet, CSV), Foxglove, rerun."""
