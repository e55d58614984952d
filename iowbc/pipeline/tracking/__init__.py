"""Tracking in MLflow through a journal on disk, so that a run never waits for MLflow and no data are lost.
MLflow's own asynchronous logging keeps unsent data in memory and loses them when the process ends."""
