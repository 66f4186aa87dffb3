"""Ray casting of several volumes that overlap, and of masks, labels and colours of samples."""
