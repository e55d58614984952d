"""The browser viewer: a policy driven by hand, and replays of evaluated trials."""
