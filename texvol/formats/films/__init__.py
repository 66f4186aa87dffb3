"""Films: H.264 in MP4 and GIF, by ffmpeg; and numbered pictures."""
