"""The stages of the pipeline, one linear file each."""
