"""Results as data: tables that are written in several forms, and pictures as files."""
