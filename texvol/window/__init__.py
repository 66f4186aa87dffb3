"""Interactive window of `texvol view`: a scene is turned and edited while its pictures are drawn.

    events ─► steering, panels ─► Document (a Scene and its history) ─► director: chooses what to draw next
                                                                         │
    screen ◄── 8-bit pictures ◄── painting processes, each with a headless Renderer

One process owns the window and does nothing that takes longer than a frame. Two other processes draw: the *mover* draws
coarse pictures while the scene changes, and the *refiner* draws fine pictures once the scene is at rest. Both use the
code of `texvol render`, so that the picture at rest is the picture that `texvol render` writes. Threads would not
suffice, because moderngl holds Python's global lock while it draws. A third process, the *clerk*, is started when a
file is to be written.

| module | responsibility |
|---|---|
| `application`, `interruption` | the main loop; Ctrl-C and termination signals |
| `desk`, `loading`, `commands` | state of the window; reading on threads; commands of keys, buttons and scripts |
| `opening`, `exporting`, `closing` | opening files; writing files; closing the window |
| `questions`, `own_files` | questions to the user; files that may be overwritten unasked |
| `replaced`, `freeing`, `switched` | documents to which undo returns, and their memory; what is switched off |
| `document` | a scene, its view, its undo history |
| `contents` | reading and changing volumes, masks and meshes of a scene |
| `navigation`, `steering` | camera moves as mathematics; events → camera moves and commands |
| `events`, `script`, `timings` | input events as data; recording and playback; table of frame times |
| `quality`, `director` | coarseness of a picture; which process draws which picture |
| `painter`, `painting`, `jobs`, `transport` | a painting process: parent side, child side, messages, transport |
| `screen`, `interface` | GLFW window; Dear ImGui in that window |
| `panels` | side panel, overlays and dialogs |
| `editing`, `histogram`, `ranges`, `handles`, `probe`, `slices` | models behind the panels |
| `saving`, `scene_writing`, `recent`, `kept` | saved scenes, recent files, width of the panels |
| `browsing`, `listing`, `naming` | file browser, listings of folders, file names |
"""
