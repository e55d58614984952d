"""The control loop, run 50 times a second in simulation and on the robot."""
