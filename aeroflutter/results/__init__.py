"""Results as labelled datasets."""
