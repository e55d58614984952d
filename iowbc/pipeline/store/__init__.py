"""What runs leave on disk: artifacts, locks, work folders."""
