"""Window at home elsewhere: drawn without a screen, seen and steered in a browser or in a notebook.

| module | responsibility |
|---|---|
| `off_screen` | screen of the window in a framebuffer of EGL or OSMesa |
| `interface_drawing` | drawing lists of Dear ImGui → OpenGL, by moderngl |
| `exchange` | newest frame and waiting events, between the window's thread and its viewers |
| `viewer` | one viewer: its messages → events, newest frame → JPEG or PNG |
| `address` | host and port that are served, and the token |
| `server` | page and websocket, by aiohttp |
| `child` | process of a window in a notebook |
| `notebook` | `texvol.show` |
| `last_picture` | last pictures as outputs of cells |
| `boxes` | last pictures of windows in boxes of widgets |
"""
