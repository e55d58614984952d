"""The skill layer: a robot and a human who transport an object together."""
