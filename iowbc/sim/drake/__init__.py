"""The same worlds stepped by Drake, a second physics engine; needs the extra `drake`."""
