"""Files of runs: artifacts, locks, work folders."""
