"""The survey's methods beside texvol's slices: measured on one scene, shown as table, plot and pictures."""
