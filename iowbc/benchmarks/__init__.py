"""Speed measurements behind `iowbc bench`."""
