"""One page about one run or several: tables, interactive curves, pictures, films, differences, provenance."""
