"""Records of runs for MLflow, by way of a journal on disk: a run never waits for MLflow, and nothing is lost.

MLflow's own asynchronous logging keeps what was not sent in memory, where it ends with the process.
"""
