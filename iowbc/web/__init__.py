"""An exported controller as a static web page, in which the robot moves on the visitor's own machine."""
