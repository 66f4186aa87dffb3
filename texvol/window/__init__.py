"""The window: a scene turned and shaped while one looks at it; `texvol view`.

    events ─► steering, panels ─► Document (a Scene, its history) ─► director: what to draw next
                                                                        │
    screen ◄── 8-bit pictures ◄── painters, processes of their own with the headless Renderer

One process owns the window and does nothing that takes long. Two others draw: the *mover*, pictures that keep up with
the hand, and the *refiner*, those at rest. They draw as `texvol render` does and encode as it does, so that what is
seen at rest is what it writes. A thread would not do: moderngl keeps Python's lock while a picture is drawn. A third,
the *clerk*, comes when a file is to be written.

| module | one responsibility |
|---|---|
| `command`, `application`, `interruption` | the command; the loop, one frame after the other; Ctrl-C |
| `desk`, `commands` | what is open and chosen; all that keys and panels can have done |
| `document` | a scene, the view of it, its history |
| `contents`, `additions`, `loading` | volumes, masks and meshes in a scene; how they come into it; files read aside |
| `navigation`, `steering` | camera moves as mathematics; events → moves and commands |
| `events`, `script`, `timings` | input as data; recorded and played back; how long frames took |
| `quality`, `director` | how coarse, how fine; who draws what, when |
| `painter`, `painting`, `jobs`, `parcels` | a painting process: this side, that side, what goes over, and how |
| `screen`, `interface` | the window; the panels' library on it |
| `panels` | what there is to choose, and what is said |
| `editing`, `histogram`, `ranges`, `handles`, `probe`, `slices` | transfer function, cutting, what is where |
| `saving`, `scene_writing`, `recent`, `browsing`, `naming` | what is taken home, found again, and called |
"""
