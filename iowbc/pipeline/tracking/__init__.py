"""What a run tells MLflow, by way of a journal on disk."""
