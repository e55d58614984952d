"""The reward in the paper's four groups (III-D); each term is a function of arrays over environments."""
