"""The process that runs an exported controller on the robot's bus: states, checks, watchdogs, timing and log."""
