"""The viewer in the browser: a policy that is driven by hand, and recorded trials to look through."""
