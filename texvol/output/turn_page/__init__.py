"""Pages that are dragged to turn a scene: pictures from all sides, and slices, in one HTML file."""
