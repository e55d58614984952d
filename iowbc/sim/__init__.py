"""MuJoCo: scenes, batched stepping, objects, partner, randomisation and sensing."""
